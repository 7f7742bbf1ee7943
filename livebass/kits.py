"""Drum channels: by General MIDI channel 10, unless a bank says otherwise. The code counts from 0."""

from __future__ import annotations

DRUMS = 9  # the channel
BANK = 0  # the controller that selects the most significant byte of a bank
GM2_DRUMS, GM2_MELODIC, XG_DRUMS = 120, 121, (126, 127)  # its values
