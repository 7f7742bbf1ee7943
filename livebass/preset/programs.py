"""The General MIDI programs that choose a preset, counted from 1 as keyboards and manuals do."""

from __future__ import annotations

DEFAULT = "jazz-finger"  # the preset of commands without another
PROGRAMS = {
    33: "upright",  # Acoustic Bass
    34: "jazz-finger",  # Electric Bass (finger)
    35: "precision-pick",  # Electric Bass (pick)
    36: "fretless",  # Fretless Bass
    37: "slap",  # Slap Bass 1
    38: "slap-impulse",  # Slap Bass 2
}


def program_of(preset: str) -> int:
    """Returns the first program, counted from 1, that chooses `preset`; if none does, an electric bass."""
    numbers = {name: number for number, name in reversed(PROGRAMS.items())}
    return numbers.get(preset, numbers[DEFAULT])
