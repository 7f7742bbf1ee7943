"""Errors of devices, each one line."""

from __future__ import annotations


class OutputLost(OSError):
    """An audio output cannot be opened or has disappeared."""


class MidiLost(OSError):
    """A MIDI port is missing; lists the existing ports."""


class NoMidi(MidiLost):
    """There is no MIDI at all; says what is missing."""


def one_line(error: BaseException) -> str:
    """A library's error message, in one line."""
    return " ".join(str(error).split())
