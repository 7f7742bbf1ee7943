"""Drum channels: by General MIDI channel 10, unless a bank or a name says otherwise. The code counts from 0."""

from __future__ import annotations

DRUMS = 9  # the channel
BANK = 0  # the controller that selects the most significant byte of a bank
MELODIC = 3  # keys of a track called bass on that channel that make it a bass: a bass drum has one or two
GM2_DRUMS, GM2_MELODIC, XG_DRUMS = 120, 121, (126, 127)  # its values
