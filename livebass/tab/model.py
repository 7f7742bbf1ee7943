"""Tablature as its readers give it, whatever the file. Lengths are in quarter notes; string 0 is the lowest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction

Curve = tuple[tuple[float, float], ...]  # (part of the length from 0 to 1, semitones)

# Slides of a note: to the next one, with or without a stroke there; out of and into the note; a pick scrape
SHIFT, LEGATO, OUT_DOWN, OUT_UP, IN_BELOW, IN_ABOVE, SCRAPE = (
    "shift", "legato", "out down", "out up", "in from below", "in from above", "scrape"
)  # fmt: skip
NATURAL, ARTIFICIAL = "natural", "artificial"  # harmonics; other kinds stay as the file calls them
FORTE = 95  # velocity of a note without a dynamic
SOFTEST, STEP = 15, 16  # velocities of ppp and from mark to mark
DYNAMICS = ("ppp", "pp", "p", "mp", "mf", "f", "ff", "fff")
MAX_BARS = 5000  # in a file and as played
LONGEST = 1024  # quarter notes in a bar
MAX_NAME = 200  # characters of a track or a section
HIGHEST_LOWEST = 33  # A1: the lowest string of a bass is no higher


class UnreadableTab(ValueError):
    """A damaged or unplayable tablature. The message is one line without the name of the file."""


@dataclass(frozen=True)
class Grace:
    """A short note before another one on its string."""

    fret: int
    length: Fraction
    dead: bool = False
    joined: str = ""  # to the note: hammer, slide, bend
    on_beat: bool = False  # it delays the note


@dataclass
class Note:
    """A note and its signs."""

    string: int
    fret: int
    velocity: int = FORTE
    tie: bool = False  # continues the note before
    dead: bool = False
    ghost: bool = False
    hammer: bool = False  # the next note on the string is hammered on or pulled off
    hammered: bool = False  # by the left hand: from silence, unless the note before on the string leads to it
    let_ring: bool = False
    staccato: bool = False
    palm: bool = False
    technique: str = ""  # tap, slap, pop, left slap
    harmonic: str = ""  # natural, artificial, pinch ...
    node: float = 0.0  # fret of the harmonic's node, from the stop
    accent: int = 0  # 1, 2: heavy
    vibrato: float = 0.0  # 0 to 1
    slides: frozenset[str] = frozenset()
    bend: Curve = ()
    trill: tuple[int, Fraction] | None = None  # fret, length of each note
    ornament: str = ""  # mordent, inverted mordent, turn, inverted turn, trill; `context.py` gives its frets
    turns: tuple[int, ...] = ()  # frets before the note's own, quickly
    tremolo: Fraction | None = None  # length of each stroke
    graces: list[Grace] = field(default_factory=list)
    passes: frozenset[int] = frozenset()  # of its bar, from 1, in which it sounds; empty: all

    @property
    def signs(self) -> list[str]:
        """Its signs, by name."""
        there = {
            "dead": self.dead, "ghost": self.ghost, "hammer": self.hammer, "let ring": self.let_ring,
            "staccato": self.staccato, "palm mute": self.palm, "accent": self.accent, "vibrato": self.vibrato,
            "bend": self.bend, "trill": self.trill, "tremolo": self.tremolo, "grace": self.graces,
            "ornament": self.turns,
        }  # fmt: skip
        found = [name for name, given in there.items() if given]
        harmonic = [f"{self.harmonic} harmonic"] if self.harmonic else []
        return [
            *filter(None, [self.technique]),
            *found,
            *harmonic,
            *(f"slide {slide}" for slide in sorted(self.slides)),
        ]


@dataclass
class Beat:
    """Notes that begin together, or a rest."""

    at: Fraction  # from the beginning of the bar
    length: Fraction
    notes: list[Note]
    stroke: str = ""  # down, up: of the pick
    hairpin: str = ""  # crescendo, diminuendo
    brush: Fraction = Fraction(0)  # from the first string to the last; negative: from the highest
    signs: tuple[str, ...] = ()  # signs that livebass does not play, by name


@dataclass(frozen=True)
class Hold:
    """A fermata: what sounds from `at` in its bar lasts `times` as long."""

    at: Fraction
    length: Fraction
    times: float

    @property
    def end(self) -> Fraction:
        return self.at + self.length


@dataclass(frozen=True)
class Tempo:
    """A tempo, reached over `over` quarter notes from `at` in its bar."""

    at: Fraction
    bpm: float
    over: Fraction = Fraction(0)


@dataclass
class Bar:
    """A bar of the whole piece."""

    length: Fraction
    beat: Fraction = Fraction(1)
    opens: bool = False  # a repeat
    plays: int = 1  # of the repeat that ends here; 1: none ends
    after_jump: bool = False  # after a jump that repeat is played again
    endings: frozenset[int] = frozenset()  # of the passes, from 1, that play this bar; empty: all
    signs: frozenset[str] = frozenset()  # segno, coda, fine, "da capo al fine" ... (order.py)
    fifths: int = 0  # sharps of the key; negative: flats
    swing: tuple[Fraction, Fraction] | None = None  # length of a pair of notes, and of its first note
    tempos: list[Tempo] = field(default_factory=list)
    name: str = ""  # of the section that begins here
    holds: list[Hold] = field(default_factory=list)


@dataclass
class Track:
    """The part of one instrument."""

    name: str
    tuning: tuple[int, ...]  # MIDI notes of the open strings, lowest first, without the capo
    capo: int
    program: int | None  # of General MIDI, from 0
    drums: bool
    bars: list[list[list[Beat]]]  # bar, voice
    tabbed: bool = True  # False: the file gives pitches, without strings and frets
    left: int = 0  # notes that are not read
    signs: tuple[str, ...] = ()  # signs of the whole track that livebass does not play, by name

    @property
    def notes(self) -> int:
        """The number of written notes, without ties."""
        return self.left + sum(not n.tie for voices in self.bars for beats in voices for b in beats for n in b.notes)


@dataclass
class Tab:
    """A piece."""

    bars: list[Bar]
    tracks: list[Track]


def shown(text: str) -> str:
    """The beginning of a name or another text of a file, in one line without control characters."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:MAX_NAME]


def put_graces(graces: Sequence[tuple[Beat, bool]], beat: Beat) -> list[Beat]:
    """Puts grace notes before the notes of a beat on their strings. Returns those on other strings as beats.

    `graces` are beats, in order, and whether they begin on the beat.
    """
    others, at = list[Beat](), beat.at
    for before, on_beat in reversed(graces):
        at -= before.length
        rest = []
        for grace in before.notes:
            note = next((note for note in beat.notes if note.string == grace.string), None)
            if note is None:
                rest.append(grace)
                continue
            joined = "hammer" if grace.hammer else "slide" if grace.slides else "bend" if grace.bend else ""
            note.graces.insert(0, Grace(grace.fret, before.length, grace.dead, joined, on_beat))
        if rest:
            others.append(replace(before, at=beat.at if on_beat else at, notes=rest))
    return others


def velocity_of(dynamic: str) -> int:
    """The velocity of a dynamic mark such as "mf"; of FORTE for an unknown one."""
    name = dynamic.lower()
    return SOFTEST + STEP * DYNAMICS.index(name) if name in DYNAMICS else FORTE


def swing_of(share: Fraction, note: Fraction) -> tuple[Fraction, Fraction]:
    """The swing of pairs of `note`: the first one gets `share` of the pair."""
    return 2 * note, 2 * note * share
