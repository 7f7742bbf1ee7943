"""MIDI messages, as (status, first, second)."""

from __future__ import annotations

Message = tuple[int, int, int]


def on(key: int, velocity: int = 90) -> Message:
    return (0x90, key, velocity)


def off(key: int) -> Message:
    return (0x80, key, 0)


def control(number: int, value: int = 0) -> Message:
    return (0xB0, number, value)


def wheel(value: int) -> Message:
    """The pitch bend wheel at `value`, -8192 to 8191."""
    return (0xE0, (value + 8192) & 127, (value + 8192) >> 7)
