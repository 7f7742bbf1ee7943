"""The hands: their actions on a string.

A new note on the sounding fret continues the same motion. On another fret the motion passes to the other of the
string's two slots, whose modes have the new length (handover.py), and the stop moves into place (stop.py).
"""
