"""MIDI messages, as (status, first, second)."""

from __future__ import annotations

Message = tuple[int, int, int]


def on(key: int, velocity: int = 90) -> Message:
    return (0x90, key, velocity)


def off(key: int) -> Message:
    return (0x80, key, 0)


def control(number: int, value: int = 0) -> Message:
    return (0xB0, number, value)
