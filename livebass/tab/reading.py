"""Reads a tablature: recognizes it by its first bytes, chooses a track and a bass, and makes a `Score`."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

from livebass.files.kinds import is_tab, kind_of
from livebass.kernels.score.lines import LONGEST as LONGEST_SCORE
from livebass.kernels.score.programs import BASS_PROGRAMS
from livebass.model.instrument import Instrument
from livebass.preset.load import load_preset
from livebass.preset.programs import PROGRAMS, program_of
from livebass.preset.source import is_path
from livebass.rows.bounds import within
from livebass.rows.techniques import DYNAMICS, MAXIMUM, MINIMUM
from livebass.rows.units import note_name
from livebass.score import tracknames
from livebass.score.reading import ScoreError, file_bytes
from livebass.score.score import Score, checked_rate, score_of
from livebass.score.takes import text_of, with_basses
from livebass.tab.containers import score_in_gpx, score_in_mxl, score_in_zip
from livebass.tab.context import fill_in
from livebass.tab.gpif import read_gpif
from livebass.tab.guitarpro import read_guitarpro
from livebass.tab.messages import Strings, to_midi
from livebass.tab.model import HIGHEST_LOWEST, LONGEST, Tab, Track, UnreadableTab, shown
from livebass.tab.musicxml import read_musicxml
from livebass.tab.perform import Performance, perform
from livebass.tab.plain import to_plain_midi
from livebass.tab.rows import Tick, to_rows
from livebass.tab.tempos import nearest_tick

READERS: dict[str, Callable[[bytes], Tab]] = {
    **{f"a Guitar Pro {version} file": read_guitarpro for version in (3, 4, 5)},
    "a Guitar Pro 6 file": lambda data: read_gpif(score_in_gpx(data)),
    "a Guitar Pro 7 file": lambda data: read_gpif(score_in_zip(data, lambda name: name.endswith("score.gpif"))),
    "a MusicXML file": read_musicxml,
    "a compressed MusicXML file": lambda data: read_musicxml(score_in_mxl(data)),
}
HIGHEST = 50  # D3, of any string
BASSES = {4: "jazz-finger", 5: "five-string", 6: "six-string"}  # by number of strings
GUITARS = range(24, 32)  # programs from 0
FOURTH = 5  # semitones to a string that the tab does not have
MAX_TEMPOS = 10_000
MAX_DIGITS = 9  # of the number of a track
MAX_NAMED = 8  # tracks in an error
MAX_SAID = 6  # kinds of what is not played
AFTER_NOUN = re.compile(r" (?=(?:beyond|on|other|without|to|in|out|off)\b)")  # in the name of a sign


@dataclass(frozen=True)
class TabRequest:
    """The user's choices in a tablature."""

    track: str = ""  # name or number; "": the bass
    bars: range | None = None  # from 0; None: all, with repeats
    dynamics: float = 0.0  # dB
    preset: str | None = None
    options: Mapping[str, Any] = field(default_factory=dict)  # `tuning` and `capo`, if given


@dataclass(frozen=True)
class Arrangement:
    """A tablature as livebass plays it."""

    path: Path  # of the file, for messages
    tab: Tab
    number: int  # of the track that plays, from 0
    performance: Performance
    rows: list[tuple[int, Tick]]  # tick of each event, and the event
    lacks: Mapping[str, int]  # signs that are not played
    dynamics: float  # dB
    preset: str
    given: dict[str, str]  # options of the preset, as a take stores them
    bass: Instrument

    @property
    def remark(self) -> str:
        """A line for the user."""
        return _track_line(self.tab, self.number, self.performance, self.lacks)

    def score(self, rate: int) -> Score:
        """The strokes at a rate, with their bass. Raises ScoreError if there are none or they last too long."""
        if not self.rows:
            raise ScoreError(f"{self.path}: has no notes")
        if (hours := float(self.performance.tempos.time(self.rows[-1][0]) / 3600)) > LONGEST_SCORE / 3600:
            raise ScoreError(f"{self.path}: lasts {hours:.1f} hours, more than {LONGEST_SCORE // 3600}")
        at, song = partial(self.performance.tempos.frame, rate=rate), self.performance
        score = replace(
            score_of([], rate, name=self.path.stem),
            remarks=(self.remark,),
            file_end=at(nearest_tick(song.end)),
            beats=tuple((round(time * rate), begins) for time, begins in song.beats(self.tab.bars)),
        )
        strokes = tuple((at(tick), *event) for tick, event in self.rows)
        return with_basses(score.with_strokes(strokes), [(0, text_of(self.preset, self.given))])

    def exported(self, plain: bool = False) -> tuple[bytes, str]:
        """A Standard MIDI File and a line about what it has.

        It is for plugins, and a take of livebass; a `plain` one is for notation and other synthesizers.
        """
        keys, bass = self.bass.player.keys.keys, self.bass
        switches = {symbol: key for key, symbol, *_ in reversed(keys) if key in bass.switches}
        program = program_of(self.preset)
        strings = Strings([string.open_note for string in bass.strings], bass.frets, switches, program)
        if plain:
            midi, lacks = to_plain_midi(self.performance, self.tab.bars, strings, self.dynamics)
        else:
            texts = [text_of(self.preset, self.given)]
            midi, lacks = to_midi(self.performance, self.tab.bars, strings, texts, self.dynamics)
        return midi, _track_line(self.tab, self.number, self.performance, lacks)


def read_tab(
    path: str | os.PathLike[str],
    rate: int,
    track: str = "",
    bars: range | None = None,
    dynamics: float = 0.0,
    preset: str | None = None,
    **tuning: Any,
) -> tuple[Instrument, Score]:
    """Reads the bass of a tablature: the bass that it asks for, tuned as the file says, and its notes.

    `Score.remarks` of the score says what is played. Needs the extra `tab`.

    Args:
        path: A Guitar Pro or MusicXML file; "-" is standard input.
        rate: Sample rate of the frames in the score, Hz.
        track: Name of a track, or its number from 1; by default the bass.
        bars: Bars to play, numbered from 0, once each; by default all, with repeats.
        dynamics: Changes the force of every note, -12 to 12 dB.
        preset: The bass that plays; by default one with as many strings.
        **tuning: `tuning`, `capo`, `a4` and `temperament` as in `load_preset`, in place of the file's.

    Raises:
        ScoreError: The file cannot be played.
        PresetError: As `load_preset`.
        LookupError: The extra `tab` is not installed.
    """
    data = file_bytes(Path(path))
    if not is_tab(data):
        raise ScoreError(f"{path}: is not a tablature")
    within("dynamics", dynamics, MINIMUM[DYNAMICS], MAXIMUM[DYNAMICS])
    if bars is not None and not (bars and bars[0] >= 0):
        raise ValueError(f"bars must be a range of numbers from 0, not {bars}")

    def load(name: str, given: Mapping[str, Any] = MappingProxyType({})) -> Instrument:
        return load_preset(name, **{**given, **tuning})

    score = score_of_tab(data, Path(path), rate, TabRequest(track, bars, dynamics, preset, tuning), load)
    (bass,) = score.basses
    capo = {"capo": int(bass.given["capo"])} if "capo" in bass.given else {}
    return load(bass.preset, {"tuning": bass.given["tuning"]} | capo), score.on_one_bass()


def score_of_tab(data: bytes, path: Path, rate: int, requested: TabRequest, load: Callable[..., Instrument]) -> Score:
    """The score of a tablature: as if livebass had recorded it, so that it names its bass.

    `load` loads a preset with a tuning and a capo. Raises ScoreError, and LookupError without the packages.
    """
    checked_rate(rate)
    return arrange(data, path, requested, load).score(rate)


def arrange(data: bytes, path: Path, requested: TabRequest, load: Callable[..., Instrument]) -> Arrangement:
    """The tablature as livebass plays it. Raises like `score_of_tab`."""
    try:
        tab = parse(data)
        number = _choose_track(tab, requested.track)
        track = tab.tracks[number]
        if track.left:
            raise UnreadableTab(f"has so many notes that livebass reads only its basses, not track {number + 1}")
        if requested.bars is not None and requested.bars[-1] >= len(tab.bars):
            raise UnreadableTab(f"has {len(tab.bars)} bars, not {requested.bars[-1] + 1}")
        performance = perform(tab, track, requested.bars)
        preset, given, bass = _bass(track, requested, load)
        rows, lacks = to_rows(performance, bass.frets, requested.dynamics)
    except UnreadableTab as error:
        raise ScoreError(f"{path}: {error}") from None
    return Arrangement(path, tab, number, performance, rows, lacks, requested.dynamics, preset, given, bass)


def parse(data: bytes) -> Tab:
    """The piece in the bytes of a file. Raises UnreadableTab, and LookupError without the packages."""
    tab = READERS[kind_of(data) or ""](data)
    for number, bar in enumerate(tab.bars, 1):
        if not 0 < bar.length <= LONGEST:
            raise UnreadableTab(f"is damaged: bar {number} has {float(bar.length):g} quarter notes")
        bar.name = shown(bar.name)
    if sum(len(bar.tempos) + len(bar.holds) for bar in tab.bars) > MAX_TEMPOS:
        raise UnreadableTab(f"has more than {MAX_TEMPOS} tempos and fermatas")
    for track in tab.tracks:
        track.name = shown(track.name)
        if any(not 0 <= note <= 127 for note in track.tuning):
            raise UnreadableTab("is damaged: a string is tuned beyond the notes of MIDI")
        if _is_written_high(track):
            track.tuning = tuple(note - 12 for note in track.tuning)
    return fill_in(tab)


def table(data: bytes, path: Path, requested: TabRequest) -> list[list[str]]:
    """The tracks of a tablature, and which one plays, as rows of a table. Raises like `score_of_tab`."""
    try:
        tab = parse(data)
        number = _choose_track(tab, requested.track)
    except UnreadableTab as error:
        raise ScoreError(f"{path}: {error}") from None
    rows = [["track", "name", "strings", "capo", "program", "notes", "bars", "signs", "played"]]
    for n, track in enumerate(tab.tracks):
        beats = (beat for voices in track.bars for voice in voices for beat in voice)
        signs = Counter(sign for beat in beats for note in beat.notes for sign in note.signs).most_common(MAX_SAID)
        rows.append([
            str(n + 1), track.name or "-", " ".join(map(note_name, track.tuning)) or "-", str(track.capo or ""),
            "drums" if track.drums else "-" if track.program is None else str(track.program + 1), str(track.notes),
            str(sum(map(bool, track.bars))), ", ".join(f"{count} {sign}" for sign, count in signs),
            "yes" if n == number else "no",
        ])  # fmt: skip
    return rows


def _is_bass(track: Track) -> bool:
    """True if a track's strings are tuned like a bass's."""
    low, high = min(track.tuning, default=127), max(track.tuning, default=127)
    return (
        track.tabbed and not track.drums and len(track.tuning) in BASSES and low <= HIGHEST_LOWEST and high <= HIGHEST
    )


def _is_written_high(track: Track) -> bool:
    """True if a bass, by its program or name, has strings tuned as its notes are written: an octave too high."""
    named = tracknames.is_bass(track.name) and track.program not in GUITARS
    return (
        (named or track.program in BASS_PROGRAMS)
        and track.tabbed
        and not track.drums
        and min(track.tuning, default=0) > HIGHEST_LOWEST
    )


def _choose_track(tab: Tab, wanted: str) -> int:
    """The number of the track to play, from 0: the `wanted` one, or the bass with the most notes."""
    if wanted:
        named = [n for n, track in enumerate(tab.tracks) if track.name.casefold() == shown(wanted).casefold()]
        numbered = int(wanted[:MAX_DIGITS]) - 1 if wanted.isdecimal() else -1
        found = [numbered] if 0 <= numbered < len(tab.tracks) else named
        if not found:
            raise UnreadableTab(f"has no track {shown(wanted)}; there is {_list_tracks(tab)}")
        return found[0]
    rules: tuple[Callable[[Track], bool], ...] = (
        _is_bass,
        lambda track: track.program in BASS_PROGRAMS,
        lambda track: tracknames.is_bass(track.name),
    )
    playing = [(n, track) for n, track in enumerate(tab.tracks) if track.notes and not track.drums]
    for rule in rules:
        basses = [(track.notes, -n) for n, track in playing if rule(track)]
        if basses:
            return -max(basses)[1]
    raise UnreadableTab(f"no track is tuned like a bass; use --track; there is {_list_tracks(tab)}")


def _list_tracks(tab: Tab) -> str:
    named = [f'{n} "{track.name}"' for n, track in enumerate(tab.tracks, 1)]
    more = f" and {len(named) - MAX_NAMED} more" if len(named) > MAX_NAMED else ""
    return ", ".join(named[:MAX_NAMED]) + more if named else "no track"


def _bass(
    track: Track, requested: TabRequest, load: Callable[..., Instrument]
) -> tuple[str, dict[str, str], Instrument]:
    """The preset that plays a track, its options as a take stores them, and its bass."""
    strings = len(track.tuning)
    if not strings:
        raise UnreadableTab(f'track "{track.name}" has no strings')
    by_program = PROGRAMS.get((track.program if track.program is not None else -1) + 1)
    default = [by_program] if strings == 4 and by_program else []
    default += [name for count, name in BASSES.items() if count >= strings]
    problem = ""
    for preset in [requested.preset] if requested.preset else default:
        bass = load(preset)
        missing = len(bass.strings) - strings
        if missing < 0:
            problem = problem or f"has {strings} strings, and {preset} has {len(bass.strings)}"
            continue
        tuning = [*track.tuning, *(track.tuning[-1] + FOURTH * (k + 1) for k in range(missing))]
        given = {"tuning": " ".join(map(note_name, tuning)), "capo": track.capo}
        try:
            bass = load(preset, given)
        except ValueError as error:
            problem = problem or f"cannot be played on {preset}: {error}"
            continue
        given |= {name: value for name, value in requested.options.items() if value is not None}
        name = os.path.abspath(preset) if is_path(preset) else preset
        return name, {key: str(value) for key, value in given.items() if value}, bass
    problem = problem or f"has {strings} strings, which no bass here has; -p names another one"
    raise UnreadableTab(f'track "{track.name}" {problem}')


def _plural(name: str) -> str:
    """The plural of the name of a sign, such as "notes beyond fret 20"."""
    noun, *rest = AFTER_NOUN.split(name, maxsplit=1)
    return " ".join([" or ".join(f"{each}s" for each in noun.split(" or ")), *rest])


def _track_line(tab: Tab, number: int, performance: Performance, lacks: Mapping[str, int]) -> str:
    """A line about the chosen track."""
    track = tab.tracks[number]
    notes = track.notes
    others = [n for n, other in enumerate(tab.tracks) if n != number and other.notes and _is_bass(other)]
    line = f'plays track {number + 1} "{track.name}", {notes} note{"s" * (notes != 1)}'
    if others:
        line += f", not the bass{'es' * (len(others) > 1)} in track {', '.join(str(n + 1) for n in others)}"
    missing = sorted(((count, name) for name, count in lacks.items() if count), reverse=True)[:MAX_SAID]
    counted = ", ".join(f"{count} {name if count == 1 else _plural(name)}" for count, name in missing)
    return f"{line}; {counted} not played" if counted else line
