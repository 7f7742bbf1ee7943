"""Errors of devices, each one line."""

from __future__ import annotations


class OutputLost(OSError):
    """An audio output cannot be opened or has gone away."""


class MidiLost(OSError):
    """A MIDI port is missing; names the ports there are."""


def one_line(error: BaseException) -> str:
    """What a library says, in one line."""
    return " ".join(str(error).split())
