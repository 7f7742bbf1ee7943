"""Does what hands do to a string.

A new note on the fret that sounds already goes into the same motion. On another fret the motion goes over to the other
one of the string's two slots, whose modes have the new length (handover.py), and the stop moves into place (stop.py).
"""
