"""How far one quality sounds from another: notes over all presets, strings, frets, dynamics and three audio rates.

Two figures a note, both of the sound in the `SPAN` seconds after the finger or thumb has let go: the error of the
characteristic frequency, eq. 14 of Issanchou et al. (2018), and the log-spectral distance. They tell how bright the
sound is and where its energy lies. Later samples, and details, differ even between one contact rate and the next:
contacts amplify the smallest difference. How much they do is measured as well: by `reference` with a player that
plucks `NUDGE` harder.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from livebass.analysis.sound import RANGE, characteristic_frequencies, spectrogram
from livebass.arrays import Floats
from livebass.bench.measure import Result, Row
from livebass.engine.engine import Engine
from livebass.model.instrument import Instrument
from livebass.model.quality import Quality
from livebass.preset.load import load_preset, preset_names

NOTE_ON, NOTE_OFF, CONTROL, ALL_SOUND_OFF = 0x90, 0x80, 0xB0, 120  # status bytes of channel 1, and a controller
SPAN = 0.3  # s of each note
GAP = 0.05  # s of silence between notes
DYNAMICS = {"soft": (25, 50), "medium": (60, 90), "hard": (100, 127)}  # velocities from and to
TURNS = ("soft", "hard", "medium", "hard")  # of each string: contact is what qualities differ in
FEWEST = 12  # notes of a preset
FRETS = 20  # 0 to 19
RATES = (44_100, 48_000, 96_000)  # Hz
NUDGE = 1e-3  # harder, 0.009 dB: no ear tells
GROUPS = {
    "no contact": "no fret or board was touched",
    "contact": "plucked strings that touched a fret",
    "slap": "presets that are slapped: struck by the thumb, or popped",
    "thumb": "the same with a thumb that has a mass",
    "board": "strings that touched a board",
}


@dataclass(frozen=True)
class Note:
    """A note of the comparison."""

    preset: str
    string: int
    fret: int
    dynamics: str  # of DYNAMICS
    velocity: int
    rate: int  # Hz, of the audio


@dataclass(frozen=True)
class Heard:
    """A note as a quality plays it."""

    sound: Floats  # (n,)
    contacts: int  # that began since the note


def representative_notes(presets: Iterable[str] | None = None, seed: int = 2018) -> list[Note]:
    """Returns the notes to compare: every string of the presets (all by default) in all dynamics, each in turn.

    At least FEWEST of each preset, half of them hard, their frets spread over 0 to FRETS - 1. A string has one of
    RATES; a preset of one or two strings has them in turn. `seed` draws velocities and frets.
    """
    notes = []
    for preset in presets if presets is not None else preset_names():
        name = preset.encode()
        rng = np.random.default_rng([seed, *name])  # a new preset leaves the notes of the others alone
        strings = len(load_preset(preset).strings)
        count = max(len(TURNS), -(-FEWEST // strings)) * strings
        frets = rng.permutation((np.arange(count) + rng.random(count)) * FRETS / count).astype(int)
        for k in range(count):
            turn, i = divmod(k, strings)
            dynamics = TURNS[turn % len(TURNS)]
            least, most = DYNAMICS[dynamics]
            rate = RATES[(sum(name) + i + (turn if strings < len(RATES) else 0)) % len(RATES)]
            notes.append(Note(preset, i, int(frets[k]), dynamics, int(rng.integers(least, most + 1)), rate))
    return notes


def even(bass: Instrument) -> Instrument:
    """Returns `bass` with a player whose every stroke is alike."""
    return replace(bass, player=replace(bass.player, unevenness=0.0))


def nudged(bass: Instrument) -> Instrument:
    """Returns `bass` with a player that plucks and strikes NUDGE harder."""
    p, more = bass.player, 1 + NUDGE
    return replace(
        bass,
        player=replace(
            p, softest=p.softest * more, hardest=p.hardest * more, greatest_apex=p.greatest_apex * more,
            strike_force=p.strike_force * more, strike_softest=p.strike_softest * more,
            strike_hardest=p.strike_hardest * more,
        ),
    )  # fmt: skip


def played(notes: Sequence[Note], quality: Quality, harder: bool = False, workers: int | None = None) -> list[Heard]:
    """Plays each of `notes` alone in `quality`, by an `even` player; `harder`: by one that is `nudged` too.

    `workers` threads (default: as many as cores) play strings side by side, which changes nothing. Raises ValueError
    for an instrument that `Engine` cannot play. [main thread]
    """
    basses = {preset: even(load_preset(preset)) for preset in dict.fromkeys(note.preset for note in notes)}
    order = sorted(range(len(notes)), key=lambda k: (notes[k].preset, notes[k].string, notes[k].rate))
    groups = [
        list(group)
        for _, group in itertools.groupby(order, lambda k: (notes[k].preset, notes[k].string, notes[k].rate))
    ]

    def play(group: list[int]) -> list[Heard]:
        bass = basses[notes[group[0]].preset]
        return play_notes(nudged(bass) if harder else bass, quality, [notes[k] for k in group])

    with ThreadPoolExecutor(workers or os.cpu_count() or 1) as pool:
        found = dict(
            pair
            for group, heard in zip(groups, pool.map(play, groups), strict=True)
            for pair in zip(group, heard, strict=True)
        )
    return [found[k] for k in range(len(notes))]


def play_notes(bass: Instrument, quality: Quality, notes: Sequence[Note]) -> list[Heard]:
    """Plays `notes`, all of one string and audio rate, one after the other; the sound begins with the release."""
    alone, rate = string_alone(bass, notes[0].string), notes[0].rate
    engine, player = Engine(alone, quality, rate, workers=1), alone.player
    strike = 0.0 if player.thumb_mass > 0 else player.strike_time
    held = round((strike if struck(alone) else player.pull_time) * rate)
    out = []

    def send(*message: int) -> None:
        engine.send(np.array([engine.frame]), np.array([message], np.uint8))

    for note in notes:
        send(NOTE_ON, alone.strings[0].open_note + note.fret, note.velocity)
        engine.process(held)
        sound = engine.process(round(SPAN * rate))[0]
        out.append(Heard(sound, engine.voices[0].note()[1]))
        send(CONTROL, ALL_SOUND_OFF, 0)
        engine.process(round(GAP * rate))
    return out


def string_alone(bass: Instrument, i: int) -> Instrument:
    """Returns `bass` with string `i` alone, which the thumb strikes only where it does on `bass`."""
    player = replace(bass.player, slapped_strings=int(i < bass.player.slapped_strings))
    return replace(bass, strings=(bass.strings[i],), necks=(bass.necks[i],), player=player)


def struck(bass: Instrument) -> bool:
    """True if the thumb strikes the lowest string of `bass`."""
    return bass.player.technique == "slap" and bass.player.slapped_strings > 0


def distance(notes: Sequence[Note], sounds: Sequence[Heard], wanted: Sequence[Heard]) -> Result:
    """Compares `sounds` of `notes` with those that are `wanted`, and groups them by the contacts of the latter.

    "each" has a row for each note: "frequency" is its `frequency_error`, "spectrum_db" and "heard_db" its
    `log_spectral_distance`, "group" one of GROUPS. "groups" has for each group that occurs, and for those over
    frets by audio rate too: "notes", the means of the three, "most_frequency", which 95 % of the notes stay
    within, "worst_frequency" and "worst", the note that has it.
    """
    presets = {note.preset: load_preset(note.preset) for note in notes}
    each: list[Row] = []
    for note, one, two in zip(notes, sounds, wanted, strict=True):
        bass = presets[note.preset]
        spectrum, heard = log_spectral_distance(one.sound, two.sound, note.rate)
        each.append({
            "preset": note.preset, "string": bass.strings[note.string].name, "fret": note.fret,
            "dynamics": note.dynamics, "velocity": note.velocity, "rate_hz": note.rate, "contacts": two.contacts,
            "group": group_of(bass, note, two), "frequency": frequency_error(one.sound, two.sound, note.rate),
            "spectrum_db": spectrum, "heard_db": heard,
        })  # fmt: skip
    groups = {group: [row for row in each if row["group"] == group] for group in GROUPS}
    frets = groups["contact"] + groups["slap"]
    for rate in RATES:
        groups[f"frets, {rate / 1e3:g} kHz"] = [row for row in frets if row["rate_hz"] == rate]
    return {
        "span_s": SPAN,
        "notes": len(each),
        "groups": {name: _summary(rows) for name, rows in groups.items() if rows},
        "each": each,
    }


def group_of(bass: Instrument, note: Note, heard: Heard) -> str:
    """Returns the one of GROUPS that a note of `bass` belongs to."""
    if not heard.contacts:
        return "no contact"
    if bass.necks[note.string].surface:
        return "board"
    if bass.player.technique != "slap":
        return "contact"
    return "thumb" if bass.player.thumb_mass > 0 else "slap"


def _summary(rows: list[Row]) -> Row:
    keys = ("frequency", "spectrum_db", "heard_db")
    means = {key: float(np.mean([row[key] for row in rows])) for key in keys}
    worst = max(rows, key=lambda row: row["frequency"])
    name = f"{worst['preset']} {worst['string']} fret {worst['fret']}, velocity {worst['velocity']}"
    most = float(np.quantile([row["frequency"] for row in rows], 0.95))
    return {
        "notes": len(rows), **means, "most_frequency": most, "worst_frequency": worst["frequency"], "worst": name,
    }  # fmt: skip


def frequency_error(sound: Floats, other: Floats, rate: int) -> float:
    """Returns the relative error of the characteristic frequency of `sound`, median over frames in which both sound.

    sound, other (n,), at `rate` (Hz). Raises ValueError if there is no such frame.
    """
    nu, wanted = characteristic_frequencies(sound, rate), characteristic_frequencies(other, rate)
    both = np.isfinite(nu) & np.isfinite(wanted)
    if not both.any():
        raise ValueError("nothing sounds: there is nothing to compare")
    return float(np.median(np.abs(nu - wanted)[both] / wanted[both]))


def log_spectral_distance(sound: Floats, other: Floats, rate: int) -> tuple[float, float]:
    """Returns the root mean square over bins of the difference of two spectra in dB, mean over frames: two values.

    Both spectra are raised to RANGE below the loudest bin of `other`. The first value is over all bins, the second
    without those, frame by frame, in which both are that low: silence is no agreement. sound, other (n,), at `rate`
    (Hz). Raises ValueError if `other` is silent.
    """
    a, b = spectrogram(sound, rate), spectrogram(other, rate)
    if not b.any():
        raise ValueError("nothing sounds: there is nothing to compare")
    floor = b.max() * 10 ** (-RANGE / 20)
    squared = (20 * np.log10(np.maximum(a, floor) / np.maximum(b, floor))) ** 2
    heard = np.maximum((np.maximum(a, b) > floor).sum(axis=1), 1)
    return float(np.sqrt(squared.mean(axis=1)).mean()), float(np.sqrt(squared.sum(axis=1) / heard).mean())
