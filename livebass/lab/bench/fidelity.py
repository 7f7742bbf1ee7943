"""The difference in sound between qualities: notes over all presets, strings, frets, dynamics and three audio rates.

Two figures per note, both for the `SPAN` seconds after the finger or thumb lets go: the error of the characteristic
frequency, eq. 14 of Issanchou et al. (2018), and the log-spectral distance. They show how bright the sound is and
where its energy lies.

Contacts amplify the smallest difference: of two plucks that no ear can distinguish one may sound half as bright again
as the other, in any quality. So each note is plucked `PLUCKS` times, with forces within `WITHIN` of its own, and the
medians over these plucks are compared, frame by frame. The chance difference of such medians is measured in the same
way, between two sets of `PLUCKS` plucks in `reference`. A quality's error is its difference beyond that.

Lossy contact amplifies little: there even the waveform of a quality is near `reference`, pluck by pluck. `waveforms`
measures how near, on the same sounds.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from livebass.engine.engine import Engine
from livebass.lab.bench.measure import Result, Row
from livebass.live.worst import ALL_SOUND_OFF, CONTROL, NOTE_ON, even
from livebass.model.instrument import Instrument
from livebass.model.quality import Quality
from livebass.preset.load import load_preset, preset_names
from livebass.rows.arrays import Floats
from livebass.sound.analysis import RANGE, characteristic_frequencies, spectrogram
from livebass.system.cores import core_count

SPAN = 0.3  # s of each note
GAP = 0.05  # s of silence between notes
DYNAMICS = {"soft": (25, 50), "medium": (60, 90), "hard": (100, 127)}  # velocity ranges
TURNS = ("soft", "hard", "medium", "hard")  # of each string: qualities differ in contacts
FEWEST = 12  # notes per preset
FRETS = 20  # 0 to 19
RATES = (44_100, 48_000, 96_000)  # Hz
PLUCKS = 6  # per note
WITHIN = 3e-3  # of the force, up and down, 0.026 dB: inaudible
STRAIGHT = "straight"
STROKES = ("pick", "pop", STRAIGHT)  # of hard notes on VISITED, besides each preset's own stroke
VISITED = ("jazz-finger", "precision-finger")
THIN = "thin"
THINNEST, HIGHEST = "six-string", (4, 5)  # a preset, and its strings that are plucked straight up, too
GROUPS = {
    "no contact": "no fret or board was touched",
    "contact": "plucked strings that touched a fret",
    "slap": "presets that are slapped: struck by the thumb, or popped",
    "thumb": "the same with a thumb that has a mass",
    "board": "strings that touched a board",
    "guests": "picked or popped on a bass for fingers, and touched a fret",
    STRAIGHT: "plucked straight up on it, and touched a fret",
    THIN: "plucked straight up on the highest strings of six, and touched a fret",
}
KINDS = {
    "frets with loss": "plucked, over frets whose contact loses energy",
    "thumb": "struck by a thumb that has a mass, over such frets",
    "pops": "popped, over such frets",
    "guests": "picked or popped on a bass for fingers, over such frets",
    STRAIGHT: "plucked straight up on it",
    THIN: "plucked straight up on the highest strings of six",
    "boards": "over a board whose contact loses energy",
    "lossless": "over frets or a board that give all energy back",
}
SAME = 1e-12  # of the reference's root mean square: sounds that differ by less count as equal


@dataclass(frozen=True)
class Note:
    """A note of the comparison."""

    preset: str
    string: int
    fret: int
    dynamics: str  # of DYNAMICS
    velocity: int
    rate: int  # Hz, of audio
    stroke: str = ""  # one of STROKES; "": the preset's own


@dataclass(frozen=True)
class Heard:
    """A note as a quality plays it: one pluck or several."""

    sounds: Floats  # (plucks, n)
    contacts: int  # started since the note; the maximum over plucks
    started: tuple[int, ...] = ()  # of each pluck


def representative_notes(presets: Iterable[str] | None = None, seed: int = 2018) -> list[Note]:
    """Returns the notes to compare: every string of the presets (all by default) with all dynamics in turn.

    Each preset gets at least FEWEST notes, half of them hard, with frets spread over 0 to FRETS - 1. A string has one
    of RATES; a preset of one or two strings takes them in turn. `seed` draws velocities and frets.
    """
    notes = []
    for preset in presets if presets is not None else preset_names():
        name = preset.encode()
        rng = np.random.default_rng([seed, *name])  # a new preset leaves the other presets' notes unchanged
        strings = len(load_preset(preset).strings)
        count = max(len(TURNS), -(-FEWEST // strings)) * strings
        frets = rng.permutation((np.arange(count) + rng.random(count)) * FRETS / count).astype(int)
        for k in range(count):
            turn, i = divmod(k, strings)
            dynamics = TURNS[turn % len(TURNS)]
            minimum, maximum = DYNAMICS[dynamics]
            rate = RATES[(sum(name) + i + (turn if strings < len(RATES) else 0)) % len(RATES)]
            notes.append(Note(preset, i, int(frets[k]), dynamics, int(rng.integers(minimum, maximum + 1)), rate))
    return notes


def guest_notes() -> list[Note]:
    """Returns hard notes of each of STROKES on each string of VISITED, at frets 0, 3, 6 and 9 in turn.

    Then come plucks straight up on the HIGHEST strings of THINNEST, which hit the frets most often.
    """
    strokes = itertools.product(VISITED, STROKES, range(4))
    thin = itertools.product(HIGHEST, (0, 3, 7, 12), (105, 127))
    return [
        *(
            Note(preset, i, 3 * ((i + k) % 4), "hard", (110, 127)[k % 2], RATES[1], stroke)
            for k, (preset, stroke, i) in enumerate(strokes)
        ),
        *(Note(THINNEST, i, fret, "hard", velocity, RATES[1], STRAIGHT) for i, fret, velocity in thin),
    ]


def guest_kind(note: Note) -> str:
    """Returns the one of GROUPS, and of KINDS, to which a note with one of STROKES belongs."""
    if note.stroke != STRAIGHT:
        return "guests"
    return THIN if note.preset == THINNEST else STRAIGHT


def forces(plucks: int = PLUCKS, other: bool = False) -> list[float]:
    """Returns the forces of `plucks` plucks, evenly spread within WITHIN of 1; `other`: a second, disjoint set."""
    return [1 + WITHIN * float(x) for x in np.linspace(-1, 1, 2 * plucks)[int(other) :: 2]]


def with_force(bass: Instrument, force: float) -> Instrument:
    """Returns `bass` with a player that plucks and strikes `force` times as hard."""
    p = bass.player
    return replace(
        bass,
        player=replace(
            p, softest=p.softest * force, hardest=p.hardest * force, greatest_apex=p.greatest_apex * force,
            release_speed=p.release_speed * force, strike_force=p.strike_force * force,
            strike_softest=p.strike_softest * force, strike_hardest=p.strike_hardest * force,
        ),
    )  # fmt: skip


def with_stroke(bass: Instrument, stroke: str) -> Instrument:
    """Returns `bass` with a player who plucks by one of STROKES; "": as before."""
    if stroke == STRAIGHT:
        return replace(bass, player=replace(bass.player, pluck_angle=0.0, angle_when_hard=0.0))
    return replace(bass, player=replace(bass.player, stroke=stroke)) if stroke else bass


def play_plucks(
    notes: Sequence[Note], quality: Quality, plucks: Sequence[float] | None = None, workers: int | None = None
) -> list[Heard]:
    """Plays each of `notes` alone in `quality`, by an `even` player, once with each force of `plucks`.

    `plucks` are relative to the note's own force, by default `forces()`. `workers` threads (default: one per core)
    play strings and plucks side by side, with the same result. Raises ValueError for an instrument that `Engine`
    cannot play. [main thread]
    """
    plucks = forces() if plucks is None else plucks
    basses = {preset: even(load_preset(preset)) for preset in dict.fromkeys(note.preset for note in notes)}

    def place(k: int) -> tuple[str, str, int, int]:
        return notes[k].preset, notes[k].stroke, notes[k].string, notes[k].rate

    groups = [list(group) for _, group in itertools.groupby(sorted(range(len(notes)), key=place), place)]

    def play(job: tuple[list[int], float]) -> list[tuple[Floats, int]]:
        group, force = job
        first = notes[group[0]]
        bass = with_force(with_stroke(basses[first.preset], first.stroke), force)
        return play_notes(bass, quality, [notes[k] for k in group])

    jobs = list(itertools.product(groups, plucks))
    found: dict[int, list[tuple[Floats, int]]] = {}
    with ThreadPoolExecutor(workers or core_count()) as pool:
        for (group, _), heard in zip(jobs, pool.map(play, jobs), strict=True):
            for k, one in zip(group, heard, strict=True):
                found.setdefault(k, []).append(one)
    out = []
    for k in range(len(notes)):
        started = tuple(contacts for _, contacts in found[k])
        out.append(Heard(np.array([sound for sound, _ in found[k]]), max(started), started))
    return out


def play_notes(bass: Instrument, quality: Quality, notes: Sequence[Note]) -> list[tuple[Floats, int]]:
    """Plays `notes`, all of one string, stroke and audio rate, one after the other; the sound begins with the release.

    Returns each sound, (n,), and the number of contacts that begin in it.
    """
    alone, rate = string_alone(bass, notes[0].string), notes[0].rate
    engine, player = Engine(alone, quality, rate, workers=1), alone.player
    strike = 0.0 if player.thumb_mass > 0 else player.strike_time
    held = round((strike if is_slapped(alone) else player.pull_time) * rate)
    out = []

    def send(*message: int) -> None:
        engine.send(np.array([engine.frame]), np.array([message], np.uint8))

    for note in notes:
        send(NOTE_ON, alone.strings[0].open_note + note.fret, note.velocity)
        engine.process(held)
        sound = engine.process(round(SPAN * rate))[0]
        out.append((sound, engine.voices[0].note()[1]))
        send(CONTROL, ALL_SOUND_OFF, 0)
        engine.process(round(GAP * rate))
    return out


def string_alone(bass: Instrument, i: int) -> Instrument:
    """Returns `bass` with only string `i`, which the thumb strikes only if it does on `bass`."""
    player = replace(bass.player, slapped_strings=int(i < bass.player.slapped_strings))
    return replace(
        bass, strings=(bass.strings[i],), necks=(bass.necks[i],), grazed=bass.grazed[i : i + 1], player=player
    )


def is_slapped(bass: Instrument) -> bool:
    """True if the thumb strikes the lowest string of `bass`."""
    return bass.player.technique == "slap" and bass.player.slapped_strings > 0


def distance(notes: Sequence[Note], sounds: Sequence[Heard], wanted: Sequence[Heard]) -> Result:
    """Compares `sounds` of `notes` with the `wanted` ones, and groups them by the contacts of the latter.

    "each" has a row per note: "frequency" is its `frequency_error`, "brighter" the same with its sign, "spectrum_db"
    and "heard_db" its `log_spectral_distance`, "group" one of GROUPS. "groups" has, for each group present and for
    fretted groups also by audio rate: "notes", the means of the four, "frequency_95", the 95 % quantile,
    "worst_frequency" and "worst", the note that has it.
    """
    presets = {note.preset: load_preset(note.preset) for note in notes}
    each: list[Row] = []
    for note, one, two in zip(notes, sounds, wanted, strict=True):
        bass = presets[note.preset]
        off, brighter = frequency_error(one.sounds, two.sounds, note.rate)
        spectrum, heard = log_spectral_distance(one.sounds, two.sounds, note.rate)
        each.append({
            "preset": note.preset, "string": bass.strings[note.string].name, "fret": note.fret,
            "dynamics": note.dynamics, "velocity": note.velocity, "rate_hz": note.rate, "contacts": two.contacts,
            "group": group_of(bass, note, two), "frequency": off, "brighter": brighter,
            "spectrum_db": spectrum, "heard_db": heard,
        })  # fmt: skip
    groups = {group: [row for row in each if row["group"] == group] for group in GROUPS}
    frets = groups["contact"] + groups["slap"]
    for rate in RATES:
        groups[f"frets, {rate / 1e3:g} kHz"] = [row for row in frets if row["rate_hz"] == rate]
    return {
        "span_s": SPAN,
        "plucks": len(wanted[0].sounds),
        "within": WITHIN,
        "notes": len(each),
        "groups": {name: _summary(rows) for name, rows in groups.items() if rows},
        "each": each,
    }


def group_of(bass: Instrument, note: Note, heard: Heard) -> str:
    """Returns the one of GROUPS to which a note of `bass` belongs."""
    if not heard.contacts:
        return "no contact"
    if note.stroke:
        return guest_kind(note)
    if bass.necks[note.string].surface:
        return "board"
    if bass.player.technique != "slap":
        return "contact"
    return "thumb" if bass.player.thumb_mass > 0 else "slap"


def waveforms(notes: Sequence[Note], sounds: Sequence[Heard], wanted: Sequence[Heard]) -> dict[str, Row]:
    """Compares waveforms of hard `notes` with contacts to the `wanted` ones, pluck by pluck, by KINDS.

    Presets with the paper's laws are skipped: they are experiments. Each of KINDS present has "notes" and "plucks",
    over all of them "median_db" and "worst_db" of the `waveform_error`, and "worst", the note of the latter.
    """
    presets = {note.preset: load_preset(note.preset) for note in notes}
    found: dict[str, list[tuple[Note, Floats]]] = {}
    for note, one, two in zip(notes, sounds, wanted, strict=True):
        bass = presets[note.preset]
        experiment = any(string.stiffness_law == "paper" for string in bass.strings)
        if note.dynamics == "hard" and two.contacts and not experiment:
            found.setdefault(kind_of(bass, note), []).append((note, waveform_error(one.sounds, two.sounds)))
    out: dict[str, Row] = {}
    for kind in [kind for kind in KINDS if kind in found]:
        errors = np.concatenate([error for _, error in found[kind]])
        worst = max(found[kind], key=lambda each: float(each[1].max()))[0]
        string = presets[worst.preset].strings[worst.string].name
        out[kind] = {
            "notes": len(found[kind]), "plucks": errors.size, "median_db": float(np.median(errors)),
            "worst_db": float(errors.max()), "worst": _note_label(worst.preset, string, worst.fret, worst.velocity),
        }  # fmt: skip
    return out


def kind_of(bass: Instrument, note: Note) -> str:
    """Returns the one of KINDS to which a hard `note` of `bass` belongs."""
    string = note.string
    neck, player = bass.necks[string], bass.player
    if not neck.contact_loss:
        return "lossless"
    if neck.surface:
        return "boards"
    if note.stroke:
        return guest_kind(note)
    if player.technique != "slap":
        return "frets with loss"
    return "thumb" if string < player.slapped_strings and player.thumb_mass > 0 else "pops"


def waveform_error(sounds: Floats, others: Floats) -> Floats:
    """Returns the root mean square of the difference relative to `others`, pluck by pluck: dB, (plucks,).

    sounds, others (n,) or (plucks, n). Raises ValueError if one of `others` is silent.
    """
    a, b = np.atleast_2d(sounds), np.atleast_2d(others)
    size = np.sqrt((b**2).mean(axis=1))
    if not size.all():
        raise ValueError("nothing sounds: there is nothing to compare")
    return np.asarray(20 * np.log10(np.maximum(np.sqrt(((a - b) ** 2).mean(axis=1)) / size, SAME)))


def _note_label(preset: str, string: str, fret: int, velocity: int) -> str:
    return f"{preset} {string} {load_preset(preset).neck(string).note_text(fret)}, velocity {velocity}"


def _summary(rows: list[Row]) -> Row:
    keys = ("frequency", "brighter", "spectrum_db", "heard_db")
    means = {key: float(np.mean([row[key] for row in rows])) for key in keys}
    worst = max(rows, key=lambda row: row["frequency"])
    name = _note_label(worst["preset"], worst["string"], worst["fret"], worst["velocity"])
    maximum = float(np.quantile([row["frequency"] for row in rows], 0.95))
    return {
        "notes": len(rows), **means, "frequency_95": maximum, "worst_frequency": worst["frequency"], "worst": name,
    }  # fmt: skip


def frequency_error(sounds: Floats, others: Floats, rate: int) -> tuple[float, float]:
    """Returns the relative error of the characteristic frequency of `sounds`, without and with its sign.

    The median over frames in which all sound, of medians over plucks, frame by frame. sounds, others (n,) or
    (plucks, n), at `rate` (Hz). Raises ValueError if there is no such frame.
    """
    nu, wanted = (
        np.median([characteristic_frequencies(sound, rate) for sound in np.atleast_2d(each)], axis=0)
        for each in (sounds, others)
    )
    both = np.isfinite(nu) & np.isfinite(wanted)
    if not both.any():
        raise ValueError("nothing sounds: there is nothing to compare")
    off = (nu - wanted)[both] / wanted[both]
    return float(np.median(np.abs(off))), float(np.median(off))


def log_spectral_distance(sounds: Floats, others: Floats, rate: int) -> tuple[float, float]:
    """Returns the root mean square over bins of the difference of two spectra in dB, mean over frames: two values.

    The spectra are medians over plucks, bin by bin, raised to RANGE below the loudest bin of `others`. The first value
    covers all bins; the second leaves out, frame by frame, bins in which both are that low: silence is no agreement.
    sounds, others (n,) or (plucks, n), at `rate` (Hz). Raises ValueError if `others` is silent.
    """
    a, b = (np.median([spectrogram(sound, rate) for sound in np.atleast_2d(each)], axis=0) for each in (sounds, others))
    if not b.any():
        raise ValueError("nothing sounds: there is nothing to compare")
    floor = b.max() * 10 ** (-RANGE / 20)
    squared = (20 * np.log10(np.maximum(a, floor) / np.maximum(b, floor))) ** 2
    heard = np.maximum((np.maximum(a, b) > floor).sum(axis=1), 1)
    return float(np.sqrt(squared.mean(axis=1)).mean()), float(np.sqrt(squared.sum(axis=1) / heard).mean())
