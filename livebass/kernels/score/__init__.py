"""The score: from the bytes of a MIDI file to the messages that a bass plays, for Python, the page and the plugins.

Kernels neither allocate nor know words: a shell counts first, hands over memory, and has the sentences and the names of
tracks. [any thread but audio]
"""
