"""A MIDI file or a tablature to play, and the table of its parts or tracks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from livebass.cli.hands import Loader
from livebass.cli.options import DEFAULT_PRESET
from livebass.cli.progress import have_kernels
from livebass.cli.score_bass import later_presets, preset_of
from livebass.cli.tabs import TabOptions
from livebass.cli.take_bass import load_take_basses
from livebass.files.kinds import is_tab
from livebass.model.instrument import Instrument
from livebass.report.text import columns
from livebass.rows.units import one_line
from livebass.score.low_keys import with_low_notes
from livebass.score.reading import ScoreError, file_bytes, read_parts, score_in
from livebass.score.score import MIN_RATE, Score

if TYPE_CHECKING:
    from livebass.tab.reading import Arrangement

AUTO = "auto"  # choice of a channel


@dataclass(frozen=True)
class Song:
    """A MIDI file or a tablature, and the options that say what to play of it."""

    path: Path
    channel: str | int
    preset: str | None
    tab: TabOptions
    load: Loader

    def read(self, rate: int) -> tuple[Score, str | None]:
        """Its score, and the preset that the options name; None if the score names the bass."""
        data = self._data()
        have_kernels()
        if is_tab(data):
            from livebass.tab.reading import score_of_tab

            return score_of_tab(data, self.path, rate, self.tab.request(self.preset), self.load), None
        return score_in(data, self.path, rate, self.channel), self.preset

    def _data(self) -> bytes:
        """The bytes of the file. Raises UsageError for options that do not suit it."""
        data = file_bytes(self.path)
        if not is_tab(data):
            self.tab.check_unused(self.path)
        elif self.channel != AUTO:
            raise click.UsageError(f"--channel is for MIDI files; in a tablature such as {self.path}, --track chooses")
        return data

    def arrangement(self) -> Arrangement:
        """A tablature as livebass plays it. Raises ScoreError for another file."""
        data = file_bytes(self.path)
        if not is_tab(data):
            raise ScoreError(f"{self.path}: is not a tablature")
        from livebass.tab.reading import arrange

        return arrange(data, self.path, self.tab.request(self.preset), self.load)

    def table(self, command: click.Command) -> str:
        """A table of its tracks or parts, and whether each would be played; `command` has the options."""
        data = self._data()
        if is_tab(data):
            from livebass.tab.reading import table

            rows = table(data, self.path, self.tab.request(self.preset))
            return "\n".join(one_line(line.rstrip()) for line in columns(rows, left=len(rows[0])))
        have_kernels()
        return _parts_table(self.path, self.channel, self.preset, self.load, command)


def _parts_table(midi: Path, channel: str | int, preset: str | None, load: Loader, command: click.Command) -> str:
    """A table of the parts of a MIDI file: what was read of each, and whether and why `channel` would play it.

    Switches are the key switches of the file's first bass. A last line names the basses that play it, if there
    are several. `preset` is the requested one; None: those that the file chooses. `command`: the one with the
    options.
    """
    loaded: Callable[[str], Instrument] = load
    try:
        score: Score | None = score_in(None, midi, MIN_RATE, channel)
        if score and preset is None:
            score, loaded = load_take_basses(score, load, DEFAULT_PRESET, command)
    except ScoreError:  # there is no bass in it, or `read_parts` says why it is unreadable
        score = None
    first = preset or preset_of(score, DEFAULT_PRESET)
    bass = loaded(first)
    are_notes = score is not None and with_low_notes(score, bass).raised > 0
    parts = read_parts(midi, channel, () if are_notes else bass.switches)
    several = len({part.port for part in parts}) > 1
    rows: list[tuple[str, ...]] = [
        ("port", "channel", "track", "bank", "program", "notes", "switches", "range", "played", "")
    ]
    for part in parts:
        whole = part.chosen == part.notes
        rows.append((
            str(part.port) if several else "", str(part.channel), part.name or "-", " ".join(map(str, part.banks)),
            " ".join(map(str, part.programs)) or "-", str(part.notes), str(part.switches or ""), part.range or "-",
            ("yes" if whole else f"{part.chosen} of them") if part.chosen else "no", part.why,
        ))  # fmt: skip
    filled = [k for k in range(len(rows[0])) if not parts or any(row[k] for row in rows[1:])]
    rows = [tuple(row[k] for k in filled) for row in rows]
    lines = columns(rows, left=len(rows[0]))
    later = [] if preset or not score else [place for place in later_presets(score, DEFAULT_PRESET) if place[2]]
    if later or (score and score.basses):
        lines.append(", ".join([first, *(f"{name} from {seconds:.1f} s" for seconds, _, name in later)]))
    return "\n".join(one_line(line.rstrip()) for line in lines)
