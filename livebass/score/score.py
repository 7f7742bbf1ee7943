"""Notes with times: a `Score`, from a list of notes or the rows of a file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from numbers import Integral

import numpy as np
from numpy.typing import NDArray

from livebass.kernels.player.messages import CONTROL, NOTE_OFF, NOTE_ON, RELEASE, WHEEL
from livebass.kernels.player.words import STROKE, Row, word_of
from livebass.kernels.score.cleaning import CLEANING_TABLES, CLEANING_WORDS, clean_messages
from livebass.kernels.score.lines import LONGEST
from livebass.kernels.score.memory import CLEANING, KEYS, PROGRAM, TIMED
from livebass.rows.bounds import between, refusal, within

MIN_RATE, MAX_RATE = 8000, 192_000  # Hz


@dataclass(frozen=True)
class TakenBass:
    """A bass that a take names, and where it starts to play."""

    frame: int
    program: int  # selects it in the score, from 0
    preset: str  # a name or a path, which need not exist
    given: Mapping[str, str]  # options of `livebass play` that changed it, by name, as typed
    file: str = ""  # the text of a preset file, as it was; "": not kept


@dataclass(frozen=True, eq=False)
class Score:
    """The notes and controllers to play, as channel messages with times.

    It keeps a program change only after the first note, and if it changes the program.
    """

    frames: NDArray[np.int64]  #: (n,) sample frames at `rate`, ascending
    messages: NDArray[np.uint8]  #: (n, 3) MIDI status and data; unused data is 0
    end_frame: int  #: of the last message, where the tail begins
    notes: int  #: number of note-ons
    name: str  #: of the piece, for messages
    rate: int  #: Hz
    program: int | None = None  #: first General MIDI program of a file, from 0; None: the file sets none
    remarks: tuple[str, ...] = ()  #: a line each: harmless damage in the file, and the chosen parts
    basses: tuple[TakenBass, ...] = ()  #: named in a take: chosen by `program` and the program changes
    file_end: int = 0  #: frame at the end of the file, including other parts; 0: no file
    foreign: bool = False  #: read from a file that is not a livebass take: its low keys may be notes (low_keys.py)
    raised: int = 0  #: notes that were too low and moved up by octaves
    left_out: int = 0  #: key switches of another instrument (low_keys.py)
    beats: tuple[tuple[int, bool], ...] = ()  #: (frame, whether a bar begins) of each beat, if the file has bars
    strokes: tuple[Row, ...] = ()  #: (frame, kind, number, value) of each event of a tablature (words.py), by frame

    @property
    def words(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Frames and words (words.py) of all messages and strokes, (n,) each, by frame, messages first."""
        frames = np.concatenate([self.frames, np.array([frame for frame, *_ in self.strokes], np.int64)])
        words = np.concatenate([packed(self.messages), np.array([word_of(*row[1:]) for row in self.strokes], np.int64)])
        order = np.argsort(frames, kind="stable")
        return frames[order], words[order]

    def with_strokes(self, strokes: tuple[Row, ...]) -> Score:
        """Returns the score with these strokes and their ends, too."""
        end = max([self.end_frame, *(frame for frame, *_ in strokes)])
        notes = self.notes + sum(kind == STROKE for _, kind, *_ in strokes)
        return replace(self, strokes=strokes, notes=notes, end_frame=end, file_end=max(end, self.file_end))

    @property
    def changes(self) -> list[tuple[int, int]]:
        """(frame, program from 0) of the program changes after the first note."""
        changed = self.messages[:, 0] & 0xF0 == PROGRAM
        return list(zip(self.frames[changed].tolist(), self.messages[changed, 1].tolist(), strict=True))

    def on_one_bass(self) -> Score:
        """Returns the score without its program changes and the basses that they choose."""
        kept = self.messages[:, 0] & 0xF0 != PROGRAM
        return replace(self, frames=self.frames[kept], messages=self.messages[kept], basses=())


def packed(messages: NDArray[np.uint8]) -> NDArray[np.int64]:
    """The words, (n,), of channel messages, (n, 3)."""
    data = messages.astype(np.int64)
    return np.asarray(data[:, 0] | data[:, 1] << 8 | data[:, 2] << 16)


def single_note(note: int, velocity: int, duration: float, rate: int) -> Score:
    """Returns a score of one note.

    Args:
        note: MIDI note, 0 to 127; C4 is 60.
        velocity: 1 to 127.
        duration: Seconds until the note-off.
        rate: Sample rate of the frames in the score, Hz.

    Raises:
        ValueError: As `score_of`.

    Example:
        >>> single_note(28, 100, 0.5, 48000).messages
        array([[144,  28, 100],
               [128,  28,  64]], dtype=uint8)
    """
    return score_of([(0.0, duration, note, velocity)], rate, name=f"note {note}")


def score_of(
    notes: Iterable[tuple[float, float, int, int]],
    rate: int,
    bends: Iterable[tuple[float, float]] = (),
    name: str = "notes",
    controls: Iterable[tuple[float, int, int]] = (),
) -> Score:
    """Returns a score of notes that you list.

    Args:
        notes: (start in s, length in s, MIDI note 0 to 127, velocity 1 to 127) of each note, in any order.
        rate: Sample rate of the frames in the score, a whole number of Hz from 8000 to 192 000.
        bends: (time in s, position -1 to 1) of each move of the pitch wheel.
        name: Name of the piece, for messages.
        controls: (time in s, controller 0 to 127, value 0 to 127) of each controller message.

    Raises:
        ValueError: A value out of these limits.

    Example:
        >>> score = score_of([(0.0, 0.25, 28, 100), (0.5, 0.25, 33, 80)], rate=48000)
        >>> score.notes, score.end_frame
        (2, 36000)
    """
    checked_rate(rate)
    events: list[tuple[int, int, int, int]] = []  # frame and message
    for start, length, note, velocity in notes:
        _check_whole("note", note, 0, 127)
        _check_whole("velocity", velocity, 1, 127)
        within("start of a note", start, 0, LONGEST, "s")
        within("length of a note", length, 0, LONGEST, "s")
        first = round(start * rate)
        last = round((start + length) * rate)
        events += [(first, NOTE_ON, note, velocity), (last, NOTE_OFF, note, RELEASE)]
    for time, position in bends:
        within("time of a bend", time, 0, LONGEST, "s")
        within("bend", position, -1, 1)
        high, low = divmod(round(8192 + 8191 * position), 128)
        events.append((round(time * rate), WHEEL, low, high))
    for time, number, value in controls:
        within("time of a controller", time, 0, LONGEST, "s")
        _check_whole("controller", number, 0, 127)
        _check_whole("value of a controller", value, 0, 127)
        events.append((round(time * rate), CONTROL, number, value))
    rows = np.zeros(len(events), TIMED)
    for row, event in zip(rows, sorted(events, key=lambda event: event[0]), strict=True):
        row["frame"], row["status"], row["first"], row["second"] = event
    return _score_of_rows(clean_events(rows, rate), name, rate)


def checked_rate(rate: int) -> None:
    """Raises ValueError unless `rate` is a whole number of Hz from MIN_RATE to MAX_RATE."""
    _check_whole("rate", rate, MIN_RATE, MAX_RATE, "Hz")


def _check_whole(name: str, number: object, minimum: int, maximum: int, unit: str = "") -> None:
    """Raises ValueError unless `number` is an integer of any kind, numpy's included, within its limits."""
    if not (isinstance(number, Integral) and minimum <= int(number) <= maximum):
        raise refusal(name, between(minimum, maximum, unit, whole=True), f"{number} {unit}".rstrip())


def messages_of(played: NDArray[np.void]) -> NDArray[np.uint8]:
    """The (n, 3) messages of PLAYED or TIMED rows."""
    return np.stack([played[name] for name in ("status", "first", "second")], axis=-1)


def clean_events(rows: NDArray[np.void], rate: int, end: int = 0) -> NDArray[np.void]:
    """Messages of one line with exactly one note-off for each note; kernels/score/cleaning.py has the rule.

    Args:
        rows: (n,) TIMED by frame.
        rate: Hz.
        end: Frame at which notes end that nothing ends.
    """
    count = len(rows)
    out = np.zeros(2 * count, TIMED)
    tables = np.zeros((CLEANING_TABLES, KEYS), np.int64)
    words = np.zeros((1 + CLEANING_WORDS, count), np.int64)
    cleaning = np.zeros(1, CLEANING)
    cleaning["rate"], cleaning["count"], cleaning["lines"], cleaning["end"] = rate, count, 1, end
    cleaning["rows"], cleaning["out"] = rows.ctypes.data, out.ctypes.data
    for name, memory in zip(
        ("table", "found", "strokes", "frames", "ends", "order", "spare"), (*tables, *words), strict=True
    ):
        cleaning[name] = memory.ctypes.data
    return out[: clean_messages(cleaning.ctypes.data)]


def _score_of_rows(rows: NDArray[np.void], name: str, rate: int) -> Score:
    """The score of cleaned TIMED rows."""
    return Score(
        frames=rows["frame"].copy(),
        messages=messages_of(rows),
        end_frame=int(rows["frame"].max(initial=0)),
        notes=int(np.count_nonzero(rows["status"] & 0xF0 == NOTE_ON)),
        name=name,
        rate=rate,
    )
