"""Chooses the bass parts of a MIDI file: one rule for everything that plays files. The page has the same (song.js).

The first of these with any notes: notes with a bass program of General MIDI; tracks called bass; a zone without a
program; the only part that is not drums; of several parts without programs, the lowest in a bass's range. Of two chosen
parts with the same notes, as files make a fuller sound, one plays.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Container, Iterable
from dataclasses import dataclass, replace
from statistics import median

from livebass import tracknames
from livebass.score.lines import BASS_PROGRAMS, Lines, Note
from livebass.score.smf import Smf
from livebass.score.spread import is_low
from livebass.units import note_name

PartKey = tuple[int, int]  # line, track
# Notes of two parts are the same if they begin so close together; parts are, if so many of their notes are
MOST_BASSES = 16  # parts that are compared
TOGETHER, SAME, LEAST = 0.03, 0.9, 4  # s; fraction of notes; notes of a part that doubles another


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


@dataclass(frozen=True)
class Choice:
    """The chosen notes of a file, and why."""

    notes: list[Note]
    why: str  # the reason in the list of parts; for the others, `else_why`
    else_why: str
    alone: bool = False  # the notes are whole parts; ignore others on their lines
    remarks: tuple[str, ...] = ()  # for the user; none: it goes without saying
    doubles: frozenset[PartKey] = frozenset()  # parts left out because another one has their notes


class Parts:
    """The notes of a file by line and track, with their names."""

    def __init__(self, smf: Smf, lines: Lines, notes: list[Note], rate: int) -> None:
        self.smf, self.lines, self.notes, self.rate = smf, lines, notes, rate
        self.by_key: dict[PartKey, list[Note]] = defaultdict(list)
        for note in notes:
            self.by_key[note.line, note.track].append(note)

    def choose(self, channel: str | int, take: bool) -> Choice:
        """Chooses the notes to play: "auto", "all" but drums, or a channel's, from 1."""
        if isinstance(channel, int):
            found = [n for n in self.notes if self.lines.lines[n.line].channel == channel - 1]
            return Choice(found, "as asked for", f"not channel {channel}")
        if take and channel == "auto":
            return Choice(self.notes, "a take of livebass", "")
        if channel == "all":
            return Choice([n for n in self.notes if not n.drums], "as asked for", "drums")
        found = [n for n in self.notes if not n.drums and n.program in BASS_PROGRAMS]
        if found:
            return self._once(Choice(found, "bass program", "no bass program"))
        named = self._chosen_by_name()
        return self._once(named) if named else self._chosen_by_place()

    def _once(self, choice: Choice) -> Choice:
        """The choice without parts whose notes another one of its parts has, too."""
        parts: dict[PartKey, list[Note]] = defaultdict(list)
        for note in choice.notes:
            if note.line not in self.lines.zone:
                parts[note.line, note.track].append(note)
        if len(parts) > MOST_BASSES:
            return choice
        kept: list[PartKey] = []
        doubles: dict[PartKey, PartKey] = {}
        for key in sorted(parts, key=lambda key: (-len(parts[key]), key)):
            same = (k for k in kept if self._has_notes(parts[k], parts[key]))
            if (other := next(same, None)) is None:
                kept.append(key)
            else:
                doubles[key] = other
        if not doubles:
            return choice
        told = (f"{self._place(key)} doubles {self._place(doubles[key])} and is left out" for key in sorted(doubles))
        return replace(
            choice,
            notes=[note for note in choice.notes if (note.line, note.track) not in doubles],
            remarks=(*choice.remarks, *told),
            doubles=frozenset(doubles),
        )

    def _place(self, key: PartKey) -> str:
        return f"track {key[1] + 1} (channel {self.lines.lines[key[0]].channel + 1})"

    def _has_notes(self, part: list[Note], other: list[Note]) -> bool:
        """True if most notes of `other` begin in `part`, too."""
        frames: dict[int, list[int]] = defaultdict(list)
        for note in part:
            frames[note.note].append(note.frame)
        together = TOGETHER * self.rate
        same = 0
        for note in other:
            own = frames[note.note]
            at = bisect_left(own, note.frame - together)
            same += at < len(own) and own[at] <= note.frame + together
        return len(other) >= LEAST and same >= SAME * len(other)

    def _chosen_by_name(self) -> Choice | None:
        tracks: dict[int, set[int]] = defaultdict(set)  # lines of each; a zone is one line
        for line, track in self.by_key:
            tracks[track].add(-1 if line in self.lines.zone else line)
        called = [
            key
            for key, notes in self.by_key.items()
            if not all(note.drums for note in notes) and self._is_called_bass(key, len(tracks[key[1]]) == 1)
        ]
        if not called:
            return None
        names = dict.fromkeys(self._bass_name(key) for key in sorted(called, key=lambda key: key[1]))
        which = ", ".join(f'"{name}"' for name in names)
        remark = f"no channel has a bass program, 33 to 40: plays the track{'s' * (len(names) > 1)} called {which}"
        return self._whole(called, "called bass", "not called bass", remark)

    def _chosen_by_place(self) -> Choice:
        zone = [note for note in self.notes if note.line in self.lines.zone and note.program is None]
        if zone:
            return Choice(zone, "a channel a string, or MPE", "no part of that instrument")
        melodic = [
            key
            for key, notes in self.by_key.items()
            if not all(note.drums for note in notes) and not tracknames.is_drums(self.name(key))
        ]
        none = "no channel has a bass program, 33 to 40, and no track is called bass"
        if len(melodic) == 1:
            remark = f"{none}: plays the only part, {self.part(melodic[0])}"
            return self._whole(melodic, "the only part", "drums", remark)
        low = [key for key in melodic if self._is_low(self.by_key[key]) and not tracknames.is_other(self.name(key))]
        if low:
            lowest = min(low, key=lambda key: (median(note.note for note in self.by_key[key]), key[1]))
            remark = f"{none}: plays the part that lies in a bass's range, {self.part(lowest)}"
            return self._whole([lowest], "in a bass's range, the lowest", "no program, but higher", remark)
        return Choice([], "", "no bass program, not called bass")

    def _whole(self, keys: Iterable[PartKey], why: str, else_why: str, remark: str) -> Choice:
        notes = [note for note in self.notes if (note.line, note.track) in keys]
        return Choice(notes, why, else_why, alone=True, remarks=(remark,))

    @staticmethod
    def _is_low(notes: list[Note]) -> bool:
        """True if notes without a program lie where a bass plays."""
        return all(note.program is None for note in notes) and is_low([note.note for note in notes])

    def name(self, key: PartKey) -> str:
        """The name of a part: its channel's, if the file names channels, or its track's."""
        line, track = key
        return self.smf.channel_names.get((track, self.lines.lines[line].channel)) or self.smf.names[track]

    def _bass_name(self, key: PartKey) -> str:
        """The name that calls a part bass."""
        name, instrument = self.name(key), self.smf.instruments[key[1]]
        return instrument if not tracknames.is_bass(name) and tracknames.is_bass(instrument) else name

    def _is_called_bass(self, key: PartKey, alone: bool) -> bool:
        """True if a part is called bass: by its channel's name, or its track's, if it is `alone` there.

        A track with several instruments has the name of the piece.
        """
        line, track = key
        channel_name = self.smf.channel_names.get((track, self.lines.lines[line].channel), "")
        return tracknames.is_bass(channel_name) or (alone and tracknames.is_bass(self._bass_name(key)))

    def listed(self, choice: Choice | None = None, switches: Container[int] = ()) -> tuple[Part, ...]:
        """The parts in the order of ports, channels and tracks. Keys in `switches` are not notes."""
        keys = sorted(self.by_key, key=lambda key: (*self.lines.lines[key[0]][:2], key[1]))
        return tuple(self.part(key, choice, switches) for key in keys)

    def part(self, key: PartKey, choice: Choice | None = None, switches: Container[int] = ()) -> Part:
        """One part, with the number of notes that `choice` takes, and why."""
        all_notes = self.by_key[key]
        notes = [note for note in all_notes if note.note not in switches]
        places = {note.place for note in choice.notes} if choice else set()
        chosen = sum(note.place in places for note in notes)
        line = self.lines.lines[key[0]]
        drums = all(note.drums for note in all_notes)
        why = ""
        if choice:
            why = (
                choice.why
                if chosen or any(n.place in places for n in all_notes)
                else "drums"
                if drums
                else "doubles another part"
                if key in choice.doubles
                else choice.else_why
            )
        return Part(
            channel=line.channel + 1,
            track=key[1] + 1,
            name=self.name(key),
            programs=tuple(dict.fromkeys(note.program + 1 for note in notes if note.program is not None)),
            notes=len(notes),
            switches=len(all_notes) - len(notes),
            lowest=min((note.note for note in notes), default=0),
            highest=max((note.note for note in notes), default=0),
            chosen=chosen,
            port=line.port + 1,
            banks=tuple(dict.fromkeys(note.bank for note in all_notes if note.bank is not None)),
            is_drums=drums,
            why=why,
        )
