"""The preset keys that tune the bass: the strings' notes, the A, a temperament, a capo."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Any, TypeVar

from livebass.model.instrument import A4_HZ, A4_NOTE
from livebass.preset.source import SCALE, TEXT, decode, file_bytes, is_scale
from livebass.rows.bounds import between
from livebass.rows.techniques import E1, TUNINGS
from livebass.rows.units import cents, note_name, note_number, quantity

LOWEST_A4, HIGHEST_A4 = 380.0, 480.0  # Hz
MAX_DOWN, MAX_UP = 5, 7  # semitones from the string's note in the file: beyond, it flaps or breaks
NOTES = 12  # of a temperament
# Cents above equal temperament, from C on; both have the same A
TEMPERAMENTS: dict[str, tuple[float, ...]] = {
    "equal": (0.0,) * NOTES,
    "just": (15.64, 27.37, 19.55, 31.28, 1.96, 13.69, 5.87, 17.6, 29.33, 0.0, 33.24, 3.91),  # in C
    "pythagorean": (-5.87, 7.82, -1.96, -11.73, 1.96, -7.82, 5.87, -3.91, 9.78, 0.0, -9.78, 3.91),
    "meantone": (10.26, -13.69, 3.42, 20.53, -3.42, 13.69, -10.26, 6.84, -17.11, 0.0, 17.11, -6.84),  # quarter comma
    "werckmeister": (11.73, 1.96, 3.91, 5.87, 1.96, 9.78, 0.0, 7.82, 3.91, 0.0, 7.82, 3.91),  # III
    "kirnberger": (10.26, 0.49, 3.42, 4.4, -3.42, 8.31, 0.49, 6.84, 2.44, 0.0, 6.35, -1.47),  # III
    "vallotti": (5.87, 0.0, 1.96, 3.91, -1.96, 7.82, -1.96, 3.91, 1.96, 0.0, 5.87, -3.91),
}
MAX_OFF = 100.0  # cents
MAPPED = re.compile(r"(.+\.scl)\s*,\s*(.+\.kbm)", re.IGNORECASE)  # a scale and its keyboard mapping
RATIO = re.compile(r"\d+(?:/\d+)?", re.ASCII)
MAX_DIGITS = 9  # of a number in a keyboard mapping
CENTS_ALLOWED = f"cents from {-MAX_OFF:g} to {MAX_OFF:g} for 12 notes, C first, or for each string"
OCTAVE_MAPPED = f"must map {NOTES} keys to an octave of 1200 cents"
EXAMPLE = 'notes from the lowest string on, such as "D1 A1 D2 G2" or DADG'
ALLOWED = f'{EXAMPLE}, MIDI numbers or "41.2 Hz"; {", ".join(TUNINGS)} or "Eb standard"'

Pitch = int | float | str  # of an open string: a MIDI number, Hz, or a note name without octave, "Eb"


@dataclass(frozen=True)
class Shift:
    """A tuning by the note of the E string, "Eb standard": every string moves as far."""

    step: int  # of the octave, from C


@dataclass(frozen=True)
class Readings:
    """The tunings that a row of letters may mean; the first with a note for each string counts."""

    each: tuple[tuple[str, ...], ...]


# A name in TUNINGS, each string's pitch, or a form that needs a bass
Tuning = str | tuple[Pitch, ...] | Shift | Readings

_LETTERS = str.maketrans({"\u266f": "#", "\u266d": "b", "\u266e": None, **dict.fromkeys("'\u2018\u2019\u2032`\"", " ")})
_WORDS = ((r"[\s-]*\bflat\b", "b"), (r"[\s-]*\bsharp\b", "#"))
_STANDARD = re.compile(r"([a-g][#b]?)[\s_-]*(?:standard|std|tuning)?", re.IGNORECASE)
_DROP = re.compile(r"drop[\s_-]*([a-g][#b]?)", re.IGNORECASE)
_DROPS = {"c#": "drop-db"}
_STEPS_DOWN = {"1/2stepdown": "half-step-down", "1stepdown": "whole-step-down", "fullstepdown": "whole-step-down"}
_APART = re.compile(r"[\s,;:/|_\u2010-\u2015-]+")
# Readings of a row of letters: B is a note and b a flat, or either may be both
_ROWS = (
    re.compile(r"[A-Ga-g](?:#|b)?"),
    re.compile(r"[a-g](?:#|b)?", re.IGNORECASE),
    re.compile(r"[a-g]#?", re.IGNORECASE),
)


def tuning_of(raw: Any) -> Tuning:
    """The value of `tuning` in a file or on the command line. Raises ValueError that says what is allowed."""
    if isinstance(raw, str):
        name = re.sub(r"[\s_]+", "-", raw.strip().lower())
        if name in TUNINGS:
            return name
        if is_scale(name):
            raise ValueError(SCALE)
        raw = re.sub(r"\s+(?=k?Hz\b)", "", raw, flags=re.IGNORECASE)
        items: Any = raw.replace(",", " ").split()
    else:
        items = raw
    if not isinstance(items, list | tuple) or not items:
        raise ValueError(f"must be {ALLOWED}")
    try:
        return tuple(_pitch(item) for item in items)
    except ValueError:
        found = _by_letters(raw) if isinstance(raw, str) else _by_names(items)
        if found is None:
            raise ValueError(f"must be {ALLOWED}") from None
        return found


def _pitch(item: Any) -> int | float:
    if isinstance(item, str) and item.lower().endswith("hz"):
        hertz = quantity(re.sub("hz$", "Hz", item, flags=re.IGNORECASE), "frequency")
        if not 5 <= hertz <= 5000:
            raise ValueError(f"{hertz} Hz")
        return hertz
    return note_number(item)


def _by_letters(text: str) -> Tuning | None:
    """A tuning as players write it: "drop D", "Eb", "E A D G", EADG. None if it is not one."""
    text = unicodedata.normalize("NFKC", text).translate(_LETTERS)
    for form, sign in _WORDS:
        text = re.sub(form, sign, text, flags=re.IGNORECASE)
    text = text.strip()
    plain = re.sub(r"[\s_-]+", "", text.lower())
    for name in TUNINGS:
        if plain in (name.replace("-", ""), f"{name.replace('-', '')}tuning"):
            return name
    if plain in _STEPS_DOWN:
        return _STEPS_DOWN[plain]
    if found := _DROP.fullmatch(text):
        return _DROPS.get(found[1].lower())
    if found := _STANDARD.fullmatch(text):
        return Shift(_step(found[1]))
    items = [item for item in _APART.split(text) if item]
    if len(items) == 1:
        return _row(items[0])
    return _by_names(items)


def _row(letters: str) -> Tuning | None:
    """The notes of a row of letters, with or without octaves."""
    if re.fullmatch(r"(?:[a-g][#b]?\d)+", letters, re.IGNORECASE):
        return tuple(note_number(name) for name in re.findall(r"[a-g][#b]?\d", letters, re.IGNORECASE))
    if not re.fullmatch(r"[a-g](?:[a-g]|#)*", letters, re.IGNORECASE):
        return None
    found = [tuple(form.findall(letters)) for form in _ROWS]
    return Readings(tuple(dict.fromkeys(names for names in found if "".join(names) == letters)))


def _by_names(items: Sequence[Any]) -> tuple[Pitch, ...] | None:
    """Notes, with or without octave. None if any item is not a note."""
    found: list[Pitch] = []
    for item in items:
        name = str(item).strip().translate(_LETTERS)
        if isinstance(item, str) and re.fullmatch(r"[a-g][#b]?", name, re.IGNORECASE):
            found.append(name)
            continue
        try:
            found.append(_pitch(item))
        except ValueError:
            return None
    return tuple(found)


def _step(name: str) -> int:
    """The step in the octave, 0 to 11 from C, of a note name without octave."""
    return note_number(f"{name[0].upper()}{name[1:].lower()}4") % NOTES


def reference_of(raw: Any) -> float:
    """The value of `a4`, Hz: 432 or "432 Hz". Raises ValueError that says what is allowed."""
    try:
        hertz = quantity(raw, "frequency") if isinstance(raw, str) and "z" in raw else float(raw)
    except (TypeError, ValueError, OverflowError):
        hertz = math.nan
    if isinstance(raw, bool) or not LOWEST_A4 <= hertz <= HIGHEST_A4:
        raise ValueError(f"must be {between(LOWEST_A4, HIGHEST_A4, 'Hz')}")
    return hertz


def temperament_of(raw: str) -> tuple[float, ...]:
    """The cents of a temperament: its name, or numbers with commas. Raises ValueError that says what is allowed."""
    name = re.sub(r"[\s_]+", "-", raw.strip().lower())
    if name in TEMPERAMENTS:
        return TEMPERAMENTS[name]
    if is_scale(name):
        raise ValueError("a file goes to --temperament; here a temperament is a name, or its cents")
    try:
        found = tuple(float(part) for part in raw.replace(",", " ").split())
    except ValueError:
        found = ()
    if not found or not all(abs(each) <= MAX_OFF for each in found):
        raise ValueError(f"must be {', '.join(TEMPERAMENTS)}; or {CENTS_ALLOWED}")
    return found


def temperament_of_file(path: str) -> tuple[float, ...]:
    """The cents of a temperament from a file: numbers as for `temperament_of`, or a Scala scale (.scl).

    "w.scl,w.kbm" is a scale with its keyboard mapping. Raises ValueError: one line that names the file.
    """
    pair = MAPPED.fullmatch(path)
    if pair is not None:
        steps = _read(pair[1], _scale_steps)
        return _read(pair[2], lambda text: _map_keys(steps, text))
    name = path.lower()
    if name.endswith(".kbm"):
        raise ValueError(f"{path}: a keyboard mapping needs its scale before it: scale.scl,mapping.kbm")
    return _read(path, _scala if name.endswith(".scl") else temperament_of)


Read = TypeVar("Read")


def _read(path: str, reader: Callable[[str], Read]) -> Read:
    """The result of `reader` for the text of a file. Raises ValueError: one line that names the file."""
    text = decode(path, file_bytes(path, "temperament", TEMPERAMENTS, TEXT), "temperament", TEXT)
    try:
        return reader(text)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _lines(text: str) -> list[str]:
    """The lines of a file of Scala without its comments."""
    return [line for line in text.splitlines() if not line.startswith("!")]


def _scale_steps(text: str) -> list[float]:
    """The notes of a Scala scale, cents above its first, with the note that ends it. Raises ValueError.

    https://www.huygens-fokker.org/scala/scl_format.html
    """
    lines = [line.split() for line in _lines(text)][1:]
    steps = [0.0]
    try:
        count = int(lines[0][0])
        for pitch, *_ in lines[1 : 1 + count]:
            steps.append(float(pitch) if "." in pitch else cents(float(_ratio(pitch))))
    except (IndexError, ValueError, ArithmeticError):
        raise ValueError("not a scale of Scala") from None
    if count < 1 or len(steps) != count + 1 or not all(map(math.isfinite, steps)):
        raise ValueError("not a scale of Scala")
    return steps


def _ratio(text: str) -> Fraction:
    """A ratio of whole numbers: Fraction itself would also compute 1e99999999. Raises ValueError, ZeroDivisionError."""
    if not RATIO.fullmatch(text):
        raise ValueError(text)
    return Fraction(text)


def _whole(text: str) -> int:
    if len(text) > MAX_DIGITS:
        raise ValueError(text)
    return int(text)


def _scala(text: str) -> tuple[float, ...]:
    """The cents of a Scala scale with C as first note and the A of equal temperament. Raises ValueError."""
    steps = _scale_steps(text)
    if len(steps) != NOTES + 1 or not _is_octave(steps[-1]):
        raise ValueError(f"must be a scale of {NOTES} notes, the last an octave of 1200 cents")
    above = [step - 100 * k for k, step in enumerate(steps[:-1])]
    return _near_equal([each - above[A4_NOTE % NOTES] for each in above])


def _is_octave(step: float) -> bool:
    return abs(step - 1200) < 0.5


def _near_equal(offsets: Sequence[float]) -> tuple[float, ...]:
    """The cents, checked. Raises ValueError."""
    if not all(abs(each) <= MAX_OFF for each in offsets):
        raise ValueError(f"must be notes within {MAX_OFF:g} cents of equal temperament")
    return tuple(offsets)


def _map_keys(steps: list[float], text: str) -> tuple[float, ...]:
    """The cents of a scale under a Scala keyboard mapping. A key without a note keeps equal temperament.

    A bass needs the same note in each octave: the mapping repeats after 12 keys. Raises ValueError.
    https://www.huygens-fokker.org/scala/help.htm#mappings
    """
    words = [line.split()[0] for line in _lines(text) if line.split()]
    try:
        size, first, last, middle, reference = map(_whole, words[:5])
        hertz, octave = float(words[5]), _whole(words[6])
        degrees = [None if word in "xX" else _whole(word) for word in words[7 : 7 + size]]
    except (IndexError, ValueError):
        raise ValueError("not a keyboard mapping of Scala") from None
    keys = first, last, middle, reference
    if not all(0 <= key <= 127 for key in keys) or first > last or not 0 < hertz / A4_HZ < math.inf:
        raise ValueError("must have keys from 0 to 127, the first not above the last, and a frequency above 0 Hz")
    if size not in (0, NOTES):
        raise ValueError(OCTAVE_MAPPED)
    count = len(steps) - 1
    if size == 0:  # the notes of the scale in turn
        size, octave, degrees = count, count, list(range(count))
    degrees += [None] * (size - len(degrees))
    above = [None if d is None else d // count * steps[-1] + steps[d % count] for d in [*degrees, octave]]
    if size != NOTES or above[-1] is None or not _is_octave(above[-1]):
        raise ValueError(OCTAVE_MAPPED)
    base = above[(reference - middle) % NOTES]
    if base is None:
        raise ValueError(f"must map its reference key, {reference}")
    base -= 100 * ((reference - middle) % NOTES)
    shift = cents(hertz / A4_HZ) - 100 * (reference - A4_NOTE)
    found = [(above[k], k) for k in ((note - middle) % NOTES for note in range(NOTES))]
    return _near_equal([shift + (0.0 if step is None else step - 100 * k - base) for step, k in found])


@dataclass(frozen=True)
class OpenString:
    """The tuning of one string: its open note, and each note's cents above equal temperament at A4_HZ."""

    note: int  # MIDI
    offsets: tuple[float, ...]  # (12,), C first


def open_strings(opens: Sequence[int], tuning: Tuning, a4: float, temperament: Sequence[float]) -> list[OpenString]:
    """The tuning of each string; `opens`: their notes in the file.

    a4: Hz; temperament: cents, 12 from C on, one for each string, or none. Raises ValueError: the message begins with
    the key, and says what does not fit.
    """
    if len(temperament) not in (0, NOTES, len(opens)):
        why = f"{len(temperament)} values; there must be {NOTES}, C first, or one for each of {len(opens)} strings"
        raise ValueError(f"temperament: {why}")
    pitches = _pitches(opens, tuning)
    standard, found = cents(a4 / A4_HZ), []
    for i, pitch in enumerate(pitches):
        note, off = (pitch, 0.0) if isinstance(pitch, int) else _nearest(pitch, a4)
        if not -MAX_DOWN <= note - opens[i] <= MAX_UP:
            minimum, maximum = note_name(max(opens[i] - MAX_DOWN, 0)), note_name(min(opens[i] + MAX_UP, 127))
            name = note_name(min(max(note, 0), 127))
            raise ValueError(
                f"tuning: {name} on the {note_name(opens[i])} string, which takes notes from {minimum} to {maximum}"
            )
        own = tuple(temperament) if len(temperament) == NOTES else (temperament[i] if temperament else 0.0,) * NOTES
        found.append(OpenString(note, tuple(standard + off + each for each in own)))
    for low, high in pairwise(found):
        if high.note <= low.note:
            both = f"{note_name(low.note)}, {note_name(high.note)}"
            raise ValueError(f"tuning: strings go from the lowest to the highest, not {both}")
    return found


def _pitches(opens: Sequence[int], tuning: Tuning) -> list[int | float]:
    """The pitch of each string, MIDI or Hz; `opens`: their notes in the file. Raises ValueError as `open_strings`."""
    if isinstance(tuning, str):
        _, by, dropped, further = TUNINGS[tuning]
        if dropped is not None and dropped not in opens:
            raise ValueError(f"tuning: this bass has no {note_name(dropped)} string")
        return [note + by - further * (note == dropped) for note in opens]
    if isinstance(tuning, Shift):
        if len(opens) == 1:
            return [_beside(opens[0], tuning.step)]
        by = _beside(E1, tuning.step) - E1
        return [note + by for note in opens]
    fitting = tuning.each if isinstance(tuning, Readings) else (tuning,)
    named = next((each for each in fitting if len(each) == len(opens)), fitting[0])
    if len(named) != len(opens):
        counted = "1 note" if len(named) == 1 else f"{len(named)} notes"
        strings = "1 string" if len(opens) == 1 else f"{len(opens)} strings"
        raise ValueError(f"tuning: {counted} for {strings}, {' '.join(note_name(note) for note in opens)}")
    pitches: list[int | float] = []
    for pitch, note in zip(named, opens, strict=True):
        if isinstance(pitch, str):
            found = _beside(note, _step(pitch))
            below = pitches[-1] if pitches else -1
            below = below if isinstance(below, int) else A4_NOTE + 12 * math.log2(below / A4_HZ)
            pitches.append(found + NOTES * (found <= below))
        else:
            pitches.append(pitch)
    return pitches


def _beside(note: int, step: int) -> int:
    """The MIDI note nearest to `note` with this `step` in the octave, 0 to 11 from C; in a tie, the lower one."""
    return note + (step - note + NOTES // 2) % NOTES - NOTES // 2


def _nearest(hertz: float, a4: float) -> tuple[int, float]:
    """The note nearest to a pitch (Hz), and the pitch's cents above it."""
    number = A4_NOTE + 12 * math.log2(hertz / a4)
    return round(number), 100 * (number - round(number))
