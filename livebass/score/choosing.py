"""The parts of a MIDI file, which of them play, and why, in words; kernels/score/choosing.py has the rule."""

from __future__ import annotations

from collections.abc import Container, Iterable
from dataclasses import dataclass

from livebass.kernels.score.remarks import CALLED, DOUBLES, LOWEST_PART, ONLY_PART
from livebass.rows.units import note_name
from livebass.score import tracknames
from livebass.score.found import Found
from livebass.score.sentences import CHOICE, REASONS, sentence
from livebass.score.smf import Smf


@dataclass(frozen=True)
class Part:
    """The notes of one channel in one track of a MIDI file."""

    channel: int  # 1 to 16
    track: int  # from 1
    name: str  # of the track; "": it has none
    programs: tuple[int, ...]  # General MIDI programs of its notes, from 1; empty: the file sets none
    notes: int
    switches: int  # note-ons of key switches, not counted as notes
    lowest: int  # note numbers; 0 without notes
    highest: int
    chosen: int  # number of its notes that play
    port: int = 1  # from 1
    banks: tuple[int, ...] = ()  # the most significant bytes of its notes' banks
    is_drums: bool = False
    why: str = ""  # chosen or not

    @property
    def range(self) -> str:
        """Lowest to highest note, "E1 to D#4"; "" without notes."""
        if not self.notes:
            return ""
        names = note_name(self.lowest), note_name(self.highest)
        return names[0] if self.lowest == self.highest else " to ".join(names)

    def __str__(self) -> str:
        programs = f"program {' '.join(map(str, self.programs))}" if self.programs else "no program"
        named = f' "{self.name}"' if self.name else ""
        several = "s" * (self.notes != 1)
        kind = "drums" if self.is_drums else programs
        port = f"port {self.port} " if self.port > 1 else ""
        return f"{port}channel {self.channel}{named} ({kind}, {self.notes} note{several}, {self.range})"


class Parts:
    """The parts of a file, with their names."""

    def __init__(self, smf: Smf, found: Found, channel: str | int) -> None:
        self._smf, self._found, self._channel = smf, found, channel

    def listed(self, switches: Container[int] = ()) -> tuple[Part, ...]:
        """The parts in the order of ports, channels and tracks. Keys in `switches` are not notes."""
        return tuple(self.part(number, switches) for number in range(self._found.parts))

    def part(self, number: int, switches: Container[int] = ()) -> Part:
        """One part, with the number of its chosen notes, and why."""
        row = self._found.part(number, switches)
        track, channel = int(row["track"]), int(row["channel"])
        return Part(
            channel=channel + 1,
            track=track + 1,
            name=self._name(track, channel),
            programs=tuple((row["program"][: row["programs"]].astype(int) + 1).tolist()),
            notes=int(row["notes"]),
            switches=int(row["switches"]),
            lowest=int(row["lowest"]),
            highest=int(row["highest"]),
            chosen=int(row["chosen"]),
            port=int(row["port"]) + 1,
            banks=tuple(row["bank"][: row["banks"]].tolist()),
            is_drums=bool(row["drums"]),
            why=REASONS[int(row["why"])].format(self._channel),
        )

    def _name(self, track: int, channel: int) -> str:
        """The name of a part: its channel's, if the file names channels, or its track's."""
        return self._smf.channel_names.get((track, channel)) or self._smf.names[track]

    def _bass_name(self, part: Part) -> str:
        """The name that calls a part bass."""
        instrument = self._smf.instruments[part.track - 1]
        return instrument if not tracknames.is_bass(part.name) and tracknames.is_bass(instrument) else part.name

    def remarks(self) -> Iterable[str]:
        """A line for each remark about the file and the choice."""
        called = dict.fromkeys(
            f'"{self._bass_name(self.part(numbers[0]))}"' for code, numbers in self._found.remarks if code == CALLED
        )
        for code, numbers in self._found.remarks:
            if code == CALLED and called:
                yield sentence(CHOICE[code], (len(called), ", ".join(called)))
                called = {}
            elif code in (ONLY_PART, LOWEST_PART):
                yield sentence(CHOICE[code], (self.part(numbers[0]),))
            elif code == DOUBLES:
                yield sentence(CHOICE[code], [number + 1 for number in numbers])
            elif code != CALLED:
                yield sentence(CHOICE[code], numbers)
