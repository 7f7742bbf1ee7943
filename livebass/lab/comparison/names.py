"""Words in the names of recordings and of their folders: dynamic, technique, kind of sound, string, take."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

SILENCE = "silence"
TECHNIQUES = {
    "fingers": "fingers finger fing fng index middle fingered fingerstyle pizz pizzicato",
    "pick": "pick picked picking plectrum plec plek pck",
    "slap": "slap slapped slapping thumb slp",
    "pop": "pop popped",
    "mute": "mute muted mutes palm pm palmmute palmmuted",  # with fingers or a pick
}
KINDS = {
    "release": "release rel releases noteoff",
    "scrape": "scrape scrapes squeak squeaks",
    SILENCE: "silence silent",  # the electronics alone
    "other": "dead ghost harmonic harmonics harm harms",
}
DEFAULT_TECHNIQUE = "fingers"  # the technique, if nothing tells it
NOTE = "note"  # the kind, if nothing tells it
WORDS = {word: name for table in (TECHNIQUES, KINDS) for name, words in table.items() for word in words.split()}
PLACES = {"open": True, "stopped": False}
LOUDNESS = ("ppp", "pp", "softest", "p", "soft", "mp", "medium", "mf", "f", "hard", "ff", "hardest", "fff")
SAME = {
    "med": "medium", "moderate": "medium", "softly": "soft", "quiet": "soft", "loud": "hard",
    "pianissimo": "pp", "piano": "p", "mezzopiano": "mp", "mezzoforte": "mf", "forte": "f", "fortissimo": "ff",
}  # fmt: skip
MIDDLE = LOUDNESS.index("medium")
BETWEEN = ("medium", "med", "mid", "mezzo")  # before a dynamic: nearer to the medium
BEYOND = ("very", "extra", "super")  # before a dynamic: further from it, but not as far as the next word
TAKE = re.compile(r"(rr|take|tk|alt|var)_?\d*")
LAYER = re.compile(r"(?:v|vl|vel|velo|velocity|lay|layer|dyn)(\d{1,3})")
NUMBERED = re.compile(
    r"rr|take|tk|alt|var|v|vl|vel|velo|velocity|lay|layer|dyn|fret"
)  # a number may follow as its own word
FRET = re.compile(r"fret\d*")
STRING = re.compile(r"string(?!s$)([a-z0-9#]*)|str([a-g][#b]?|[1-9])?|([a-g][#b]?)str(?:ing)?")
NAMED = re.compile(r"([a-g][#b]?)\d?")  # a string by its note
COUNTED = re.compile(r"([1-9])(?:st|nd|rd|th)?")  # a string by its number, from the highest


@dataclass(frozen=True)
class NameInfo:
    """A recording as its names tell it."""

    technique: str = DEFAULT_TECHNIQUE
    kind: str = NOTE  # or one of KINDS
    dynamic: str = ""  # "": not told
    string: str = ""  # its note, or its number from the highest string; "": not told
    open: bool | None = None  # whether the string is open; None: not told
    place: str = ""  # the other words, but not the take: equal for notes of one key


def info_of_name(parts: Sequence[str]) -> NameInfo:
    """Reads the names of a recording: of its folders, from the outermost, and last of the file without its ending."""
    each = [words_of(part) for part in parts]
    every = [word for words in each for word in words]
    known = [WORDS[w] for w in map(_without_number, every) if w in WORDS]
    dynamic, used = _dynamic(each)
    place = " ".join(w for w in each[-1] if _without_number(w) not in WORDS and w not in used and not TAKE.fullmatch(w))
    default = SILENCE if is_quiet(parts[-1]) and not re.search("[a-z]", place) else NOTE  # "quiet" alone, or of a note
    return NameInfo(
        next((name for name in reversed(TECHNIQUES) if name in known), DEFAULT_TECHNIQUE),
        next((name for name in known if name in KINDS), default),
        dynamic,
        _string(every),
        next((PLACES[w] for w in every if w in PLACES), None),
        place,
    )


def is_quiet(name: str) -> bool:
    """True if a name calls a recording quiet: a soft note, or a silence."""
    return "quiet" in map(_without_number, words_of(name))


def words_of(name: str) -> list[str]:
    """The words of a name, in lower case, split at capitals and after numbers, too: "stringE", "E1soft".

    "#" is a sharp, unless it stands behind a number or before a note, as in "Picked1#D1".
    """
    name = re.sub(r"(?<=\d)#|#(?=[A-Ga-g][#b]?\d)", " ", name)
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=\d)(?=[A-Za-z]{2})(?!(?:st|nd|rd|th)(?![a-z]))", " ", name)
    words: list[str] = []
    for word in re.split(r"[^0-9a-z#]+", parted.lower()):
        if word.isdigit() and words and NUMBERED.fullmatch(words[-1]):
            words[-1] += word
        elif word:
            words.append(word)
    return words


def strength(dynamic: str) -> tuple[int, float]:
    """A key that sorts dynamics from soft to hard: words, then layers by their number."""
    *before, word = dynamic.split()
    if word in LOUDNESS:
        place = float(LOUDNESS.index(word))
        if before:
            place += 0.4 * (MIDDLE - place) if before[0] in BETWEEN else 0.4 if place > MIDDLE else -0.4
        return 0, place
    number = re.search(r"\d+", dynamic)
    return 1, float(number[0]) if number else 0.0


def _dynamic(each: Sequence[Sequence[str]]) -> tuple[str, set[str]]:
    """The dynamic, and the words that tell it.

    A single f or p counts last, and only in the file's name: it may be a note, or a kind of bass. Of several words the
    last one counts. A folder tells it if the file's name does not.
    """
    for words in reversed(each):
        found = _dynamics(words)
        layers = [(f"v{int(m[1])}", {w}) for w in words if (m := LAYER.fullmatch(w))]
        sure = [match for match in found if max(map(len, match[1])) > 1]
        if sure or layers or (found and words is each[-1]):
            chosen = (sure or layers or found)[-1]
            return chosen[0], chosen[1] | {w for _, used in layers for w in used}
    return "", set()


def _dynamics(words: Sequence[str]) -> list[tuple[str, set[str]]]:
    found: list[tuple[str, set[str]]] = []
    for k, word in enumerate(words):
        plain = _loudness(word)
        if not plain or (k + 1 < len(words) and word in BETWEEN and _loudness(words[k + 1])):
            continue
        before = words[k - 1] if k and words[k - 1] in (*BETWEEN, *BEYOND) else ""
        half = before == "mezzo" and plain in ("p", "f")
        found.append((f"m{plain}" if half else f"{before} {plain}".strip(), {before, word} - {""}))
    return found


def _loudness(word: str) -> str:
    """The dynamic that a word names; "" if it names none."""
    plain = _without_number(word)
    plain = SAME.get(plain, plain)
    return plain if plain in LOUDNESS else ""


def _without_number(word: str) -> str:
    """A word without the number of a take that follows it: "soft2"."""
    glued = re.fullmatch(r"([a-z]{2,})\d+", word)
    return glued[1] if glued else word


def _string(words: Sequence[str]) -> str:
    """The string: "stringE", "string E", "E string", "4th string"."""
    for k, word in enumerate(words):
        match = STRING.fullmatch(word)
        if not match:
            continue
        if name := match[1] or match[2] or match[3]:
            return name.capitalize()
        beside = [words[j] for j in (k + 1, k - 1) if 0 <= j < len(words)]
        for kind in (NAMED, COUNTED):
            for near in beside:
                if m := kind.fullmatch(near):
                    return m[1].capitalize()
        if k + 1 < len(words) and not _is_known(words[k + 1]):
            return words[k + 1].capitalize()
    return ""


def _is_known(word: str) -> bool:
    """True if a word means something other than a string's name."""
    if _without_number(word) in WORDS or word in PLACES or _loudness(word):
        return True
    return any(pattern.fullmatch(word) for pattern in (TAKE, LAYER, FRET))
