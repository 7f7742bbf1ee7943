"""Explains MIDI messages from the rows of techniques, for `play --controllers`."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

from livebass.model.keymap import COUNTING, MODO, PLACE, named_keys
from livebass.rows import techniques
from livebass.rows.units import pitch_name

WIDTH, INDENT = 120, 20  # characters
LEARNT = f"{', '.join(techniques.LEARNABLE[:-1])} or {techniques.LEARNABLE[-1]}"
NOTES = {
    "1-16 channels": "--channel selects one; the default is all",
    "note-on": "velocity is the force of the pluck, by --velocity-curve; the note decides string and fret",
    "note-off": "velocity is the force of a pull-off",
    "pitch bend": "2 semitones, or as RPN 0 sets, up to 96",
}
OTHERS = {
    f"{techniques.LEARNED} to {techniques.LEARNED + techniques.PARAMETERS - 1}": f"{', '.join(techniques.LEARNABLE)}; "
    "MIDI takes record here what --learn moves",
    "program": "General MIDI 33 to 38 choose a preset, see `livebass presets list`; in a --file only without -p",
    "6, 38, 100, 101": "RPN 0: range of the pitch bend; RPN 1 and 2: tuning; RPN 6: MPE, where each note has its own "
    "bend, vibrato by pressure and plucking place by controller 74",
    "126": "1: overlapping notes up to two frets apart are legato; 2 and more: a channel per string, the highest "
    "string first, as MIDI guitars do, each with its own wheel; notes on channels without a string are dropped, and "
    "counted",
    "any other": f"assigned by --learn: {LEARNT}; 64 is the bass's own value, 127 for gain",
    "120, 121, 123": "all sound off, reset all controllers, all notes off, on their channel",
}
KEYS = f"""\
Key switches of --keys modo, below the notes of the bass, and of --keys modo-12, which replace notes
({COUNTING}):"""
MORE = """\
For a map of your own see `livebass presets keymap`; --controllers --keys FILE explains it. With --wheel slide the pitch
wheel slides over frets, 2 up or down."""


def controllers_text() -> str:
    """Returns the text of `play --controllers` for the default key map."""
    lines = [*NOTES.items(), *((f"controller {label}", said) for label, said in controllers()), *OTHERS.items()]
    keys = [("modo", "modo-12", "hold: while the key is down")]
    for row in techniques.TECHNIQUE_ROWS.values():
        keys += switches(row)
    wide = [max(len(row[column]) for row in keys) + 2 for column in range(2)]
    return "\n".join(
        [
            *(entry(*line) for line in lines),
            f"\n{KEYS}\n",
            *(f"  {modo:{wide[0]}}{modo_12:{wide[1]}}{what}" for modo, modo_12, what in keys),
            f"\n{MORE}",
        ]
    )


def entry(label: str, said: str) -> str:
    """A message and its effect, in one line or several."""
    begin = f"  {label}".ljust(INDENT)
    return textwrap.fill(said, WIDTH, initial_indent=begin, subsequent_indent=" " * INDENT, break_on_hyphens=False)


def controllers() -> Iterator[tuple[str, str]]:
    """The controllers of each function in the default map, in order, and its help."""
    numbers = dict(sorted({**dict(MODO.controllers), PLACE: "place"}.items()))
    for symbol in dict.fromkeys(numbers.values()):
        yield (
            ", ".join(str(n) for n, other in numbers.items() if other == symbol),
            techniques.FUNCTION_ROWS[symbol].help,
        )


def switches(row: techniques.Technique) -> list[tuple[str, str, str]]:
    """The keys of a technique in both maps, and its effect; for the technique that chooses a string, one by one."""
    if row.number != techniques.ON_STRING:
        return [(named_keys(row.modo), named_keys(row.modo_12), f"{row.trigger}: {meaning(row)}")]
    return [
        (named_keys((low,)), named_keys((high,)), f"{row.trigger}: {row.help}: {pitch_name(low)}")
        for low, high in zip(row.modo, row.modo_12, strict=True)
    ]


def meaning(row: techniques.Technique) -> str:
    """Explains the effect of a technique, and its values."""
    values = {techniques.ON_STRING: f": {open_notes(row)}", techniques.HAND_AT: f", 1 to {techniques.FRETS}"}
    return row.help + values.get(row.number, "")


def open_notes(row: techniques.Technique) -> str:
    """The open notes that the keys of a technique select in the map of MODO BASS."""
    return " ".join(pitch_name(key) for key in row.modo)
