"""Renders a bass to a sample pack: FLAC files and the SFZ file that lets samplers play them.

Each key plays on the string of a lone note, the one with the lowest fret. A zone is a few neighbouring frets of a
string, sampled at one of them; an open string has a zone of its own, as it rings differently. A zone is sampled at
some velocities (layers) and, if the player is uneven, several times at each (round robins).

A sample is the sound of `livebass render --note` for the same velocity and seed, held until it has died away or for the
pack's longest time, over which it fades out. So its level is the engine's. Between two sampled velocities the level
follows a straight line in dB; below the lowest, the player's law of force. The SFZ file expresses this by the group's
amp_velcurve and the regions' volume.
"""

from __future__ import annotations

import io
import math
import os
import re
from collections import deque
from collections.abc import Generator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
import soundfile
from numpy.typing import NDArray

from livebass.engine.engine import Engine, single
from livebass.engine.render import RenderError, mix_strings, string_names
from livebass.files.whole import Transaction, whole_directory
from livebass.kernels.player.constants import STANDARD
from livebass.model.instrument import A4_HZ, STROKES, Instrument, Player
from livebass.model.keymap import velocity_parts
from livebass.model.quality import QUALITIES, Quality
from livebass.report.progress import Progress, steps
from livebass.report.text import runs
from livebass.rows.units import OFF, note_name
from livebass.score.score import single_note
from livebass.sound.audiofile import SUBTYPES, AudioWriter, encoding
from livebass.system.cores import core_count
from livebass.system.interrupts import StopFlag

HARDEST = 127  # velocity
SOFT_SHARE = 0.35  # of the layers lie below the velocity that grazes the frets
QUIET = 10 ** (-72 / 20)  # of its peak: a sample ends where it stays below
FADE = 0.05  # s, at the end of a sample that has died away
FADED = 0.25  # of the longest length: the fade of a sample that has not
FULL = 10 ** (-0.3 / 20)  # highest peak of a sample; louder ones are stored lower, and played back louder
LEVEL_TIME = 0.5  # s, part of a sample whose RMS is its level
HANDS = 0.85  # of player.hand_damping: mean rate at which fingers that ease off end a note
RELEASE_NEPERS = 9.0  # fall of a sound during ampeg_release in samplers: sfizz's value
SHORTEST_RELEASE, LONGEST_RELEASE = 0.01, 100.0  # s
CURVE_STEP = 4  # velocities between two points of amp_velcurve: samplers join them by straight lines

HEAD = "// A livebass sample pack: "  # start of the SFZ file
LICENCE_FILE, FOLDER = "LICENSE.txt", "samples"
LICENCE = """\
The samples in this folder, and the .sfz file that plays them, were computed by livebass
from the physics of a string. Nobody's playing was recorded.

They are free to use. You may play, copy, change, sell and pass them on, in whole or in
part, alone or in music, films, games, instruments and anything else, for any purpose,
also commercially, without asking, without payment and without naming anyone. Nobody
claims any right in them.

They come as they are, without warranty of any kind.
"""


@dataclass(frozen=True)
class PackSettings:
    """The contents of a pack, and the precision of computing it."""

    quality: Quality
    rate: int = 48000  # Hz
    frets: int = 3  # of a zone, at most
    layers: int = 5  # velocities at which a zone is sampled
    robins: int = 2  # samples of a zone at a velocity; 1 if the player is not uneven
    length: float = 8.0  # s, longest sample
    seed: int = 0  # of the player's unevenness


@dataclass(frozen=True)
class Zone:
    """Neighbouring keys that share one sampled note."""

    string: int  # index
    fret: int  # sampled
    note: int  # sampled
    lowest: int  # keys
    highest: int


@dataclass(frozen=True)
class Sample:
    """One file of a pack."""

    zone: Zone
    velocity: int
    robin: int  # from 0
    seed: int
    file: str


@dataclass(frozen=True)
class Stored:
    """The levels of a written sample."""

    level: float  # dB re full scale, RMS of its first LEVEL_TIME, from the engine
    lowered: float  # dB, by which its file is lower


@dataclass(frozen=True)
class PackReport:
    """Counts and sizes of a written pack."""

    sfz: Path
    samples: int
    duration_s: float  # of all samples
    size: int  # bytes of all files


class Pack:
    """The plan of a pack: the notes to sample, their velocities and seeds."""

    def __init__(self, bass: Instrument, name: str, settings: PackSettings) -> None:
        """`name`: of the SFZ file and the preset, for its comments. Raises ValueError for a bad rate."""
        self.bass, self.name, self.settings = bass, name, settings
        self.encoding = encoding(Path(f"{name}.flac"), settings.rate, "flac", "24")
        tempered = any(len(set(string.offsets)) > 1 for string in bass.strings)  # samplers shift by equal semitones
        self.zones = zones(bass, 1 if tempered else settings.frets)
        self.velocities = velocities(bass.player, settings.layers)
        self.robins = settings.robins if bass.player.unevenness else 1
        names = [name.replace("#", "s") for name in string_names(bass)]  # "#" begins a directive in some samplers
        self.samples = [
            Sample(
                zone, velocity, robin, settings.seed + number * self.robins + robin,
                f"{names[zone.string]}-{zone.fret:02}-v{velocity:03}-{robin + 1}.flac",
            )
            for number, zone in enumerate(self.zones)
            for velocity in self.velocities
            for robin in range(self.robins)
        ]  # fmt: skip

    @cached_property
    def engine(self) -> Engine:
        """The prepared bass without its floor, which would add up in simultaneous samples.

        Raises ValueError for a bass that cannot play at this rate. [main thread]
        """
        bass = replace(self.bass, player=replace(self.bass.player, floor_noise=OFF, hum=OFF))
        return Engine(bass, self.settings.quality, self.settings.rate, workers=1)


def zones(bass: Instrument, frets: int) -> list[Zone]:
    """The zones of a bass, of up to `frets` frets: by string, then by key."""
    found = []
    for string, keys in enumerate(keys_by_string(bass)):
        open_note = bass.strings[string].open_note
        for run in runs(keys):
            opened = run[:1] if run[0] == open_note else []
            stopped = run[len(opened) :]
            parts = np.array_split(stopped, math.ceil(len(stopped) / frets)) if stopped else []
            for part in ([opened] if opened else []) + [p.tolist() for p in parts]:
                note = part[len(part) // 2]
                found.append(Zone(string, note - open_note, note, part[0], part[-1]))
    return found


def keys_by_string(bass: Instrument) -> list[list[int]]:
    """The keys that each string plays when no other note sounds: those with their lowest fret on it."""
    frets = min(len(neck.fret_positions) for neck in bass.necks)
    keys: list[list[int]] = [[] for _ in bass.strings]
    for key in range(128):
        having = [i for i, s in enumerate(bass.strings) if 0 <= key - s.open_note <= frets]
        if having:
            keys[min(having, key=lambda i: key - bass.strings[i].open_note)].append(key)
    return keys


def velocities(player: Player, layers: int) -> tuple[int, ...]:
    """The velocities to sample, ascending; the last is HARDEST.

    Below the velocity that just grazes the frets, notes of different strength sound nearly alike, so most layers lie
    above it. On either side they are evenly spaced.
    """
    lift = float(STANDARD["lift"][STROKES.index(player.stroke)])
    graze = _velocity_of(math.log(1 / (lift * max(player.softest, 1e-3))) / _range(player), player)
    soft = round(SOFT_SHARE * layers) if HARDEST / layers < graze < HARDEST else 0
    chosen = [graze * (k + 1) / soft for k in range(soft)]
    start, hard = (graze if soft else 0.0), layers - soft
    chosen += [start + (HARDEST - start) * (k + 1) / hard for k in range(hard)]
    return tuple(sorted({max(1, round(v)) for v in chosen}))


def _velocity_of(part: float, player: Player) -> float:
    """The velocity at which notes reach this `part` of the way from the softest to the hardest."""
    parts = velocity_parts(player.velocity_curve)
    above = next((v for v in range(1, HARDEST + 1) if parts[v] >= part), HARDEST)
    if above == 1 or parts[above] < part:
        return float(above)
    return above - (parts[above] - part) / (parts[above] - parts[above - 1])


def _range(player: Player) -> float:
    """Natural logarithm of the strength ratio of the hardest to the softest note, positive."""
    return max(math.log(player.hardest / max(player.softest, 1e-3)), 1e-6)


def edges(chosen: tuple[int, ...]) -> list[tuple[int, int]]:
    """Lowest and highest velocity for each sampled one: up to the middle between two."""
    tops = [(a + b) // 2 for a, b in pairwise(chosen)] + [HARDEST]
    return list(zip([1] + [top + 1 for top in tops[:-1]], tops, strict=True))


def export_sfz(
    bass: Instrument, folder: str | os.PathLike[str], name: str, settings: PackSettings | None = None,
    progress: Progress | None = None,
) -> PackReport:  # fmt: skip
    """Renders a bass into a sample pack for SFZ samplers: 24-bit FLAC samples, NAME.sfz and a licence.

    Args:
        bass: The bass.
        folder: To write; an older pack there is replaced, or nothing is written.
        name: Of the SFZ file.
        settings: Contents and precision; None: in studio quality, five layers, two samples each.
        progress: Gets the fraction done, 0 to 1.

    Raises:
        ValueError: A rate that the bass cannot be played at.
        OutputError: The folder cannot be written, or holds something else.
    """
    return write_pack(Pack(bass, name, settings or PackSettings(QUALITIES["studio"])), Path(folder), progress)


def write_pack(pack: Pack, directory: Path, progress: Progress | None = None) -> PackReport:
    """Writes `pack` into `directory`: its SFZ file, the samples and their licence; all or nothing.

    Makes the directory if missing; it may be empty or hold an older pack, which is replaced. The same pack gives the
    same files, bit for bit, on one kind of processor. Raises ValueError, OutputError, RenderError. [main thread]
    """
    rate = pack.settings.rate
    with whole_directory(directory, is_pack) as new, closing(_play_samples(pack)) as sounds:
        (new / FOLDER).mkdir()
        done, frames, stored = steps(progress, len(pack.samples)), 0, []
        for sample, sound in sounds:
            kept = _lower_peak(sound)
            with Transaction() as files:
                writer = AudioWriter(files, new / FOLDER / sample.file, pack.encoding)
                writer.write(kept)
                writer.close()
            stored.append(_measure_levels(sound, kept, rate))
            frames += len(sound)
            done()
        with Transaction() as files:
            files.write_text(new / f"{pack.name}.sfz", sfz_text(pack, stored))
            files.write_text(new / LICENCE_FILE, LICENCE)
        size = sum(file.stat().st_size for file in new.rglob("*") if file.is_file())
    return PackReport(directory / f"{pack.name}.sfz", len(stored), frames / rate, size)


def estimated_size(pack: Pack) -> int:
    """Estimates the bytes of `pack` from a sample per string, at a middle velocity. Raises ValueError, RenderError."""
    middle, total = pack.velocities[(len(pack.velocities) - 1) // 2], 0
    for string in range(len(pack.bass.strings)):
        mine = [s for s in pack.samples if s.zone.string == string and s.robin == 0 and s.velocity == middle]
        if mine:
            sample = mine[len(mine) // 2]
            file = io.BytesIO()
            sound = _lower_peak(play_sample(pack.engine.another(sample.seed), sample, pack.settings.length))
            soundfile.write(file, sound, pack.settings.rate, SUBTYPES["flac"]["24"], format="FLAC")
            total += len(file.getvalue()) * sum(s.zone.string == string for s in pack.samples)
    return total


def is_pack(entries: list[Path]) -> bool:
    """True if the `entries` of a directory are a pack and nothing else."""
    by_name = {entry.name: entry for entry in entries}
    lists = [name for name in by_name if name.endswith(".sfz")]
    if len(lists) != 1 or set(by_name) - {*lists, LICENCE_FILE, FOLDER}:
        return False
    try:
        text = by_name[lists[0]].read_text("utf-8")
        samples = {file.name for file in by_name[FOLDER].iterdir()} if FOLDER in by_name else set()
    except (OSError, UnicodeDecodeError):
        return False
    return text.startswith(HEAD) and samples <= set(re.findall(r"sample=(\S+)", text))


def _play_samples(pack: Pack) -> Generator[tuple[Sample, NDArray[np.float32]], None, None]:
    """Yields each sample of `pack` with its sound (n,), in order; computes one per core at a time."""
    engine, stop = pack.engine, StopFlag()

    def play(sample: Sample) -> NDArray[np.float32]:
        return play_sample(engine.another(sample.seed), sample, pack.settings.length, stop)

    cores, ahead = core_count(), deque[tuple[Sample, Future[NDArray[np.float32]]]]()
    with ThreadPoolExecutor(cores) as workers:
        try:
            for sample in pack.samples:
                ahead.append((sample, workers.submit(play, sample)))
                if len(ahead) > 2 * cores:
                    yield ahead[0][0], ahead.popleft()[1].result()
            for sample, sound in ahead:
                yield sample, sound.result()
        finally:
            stop.set()
            workers.shutdown(wait=False, cancel_futures=True)


def play_sample(engine: Engine, sample: Sample, length: float, stop: StopFlag | None = None) -> NDArray[np.float32]:
    """The sound (n,) of a sample on an `engine` at rest, at most `length` s, with its end. Raises RenderError.

    Once `stop` is set, it returns an unusable partial sound. [any thread]
    """
    rate = engine.rate
    blocks, peak = [], 0.0
    for strings in engine.play(single_note(sample.zone.note, sample.velocity, length, rate), 0.0):
        if not np.isfinite(strings).all():
            raise RenderError(f"the sound of {note_name(sample.zone.note)} is not finite; please report the preset")
        blocks.append(mix_strings(single(strings)))
        loudest = float(np.max(np.abs(blocks[-1]), initial=0.0))
        peak = max(peak, loudest)
        if loudest <= QUIET * peak or (stop is not None and stop.is_set()):
            break
    return cut_end(np.concatenate(blocks), rate, round(length * rate))


def cut_end(sound: NDArray[np.float32], rate: int, longest: int) -> NDArray[np.float32]:
    """`sound` (n,) cut where it stays quiet, with a fade; a sound of `longest` frames fades out slowly."""
    loud = np.flatnonzero(np.abs(sound) > QUIET * np.max(np.abs(sound), initial=0.0))
    fade = round(FADE * rate)
    count = (int(loud[-1]) + 1 if loud.size else 0) + fade
    if count >= longest:
        count, fade = longest, max(fade, round(FADED * longest))
    kept = sound[:count].copy()
    fade = min(fade, len(kept))
    if fade:
        kept[-fade:] *= np.cos(0.5 * np.pi * (np.arange(fade) + 1) / fade).astype(np.float32) ** 2
        kept[-1] = 0.0
    return kept


def _lower_peak(sound: NDArray[np.float32]) -> NDArray[np.float32]:
    """`sound`, scaled down if it exceeds or nearly reaches full scale."""
    peak = float(np.max(np.abs(sound), initial=0.0))
    return sound if peak <= FULL else sound * np.float32(FULL / peak)


def _measure_levels(sound: NDArray[np.float32], kept: NDArray[np.float32], rate: int) -> Stored:
    part = sound[: round(LEVEL_TIME * rate)].astype(np.float64)
    power = float(np.mean(part**2)) if part.size else 0.0
    peaks = [float(np.max(np.abs(s), initial=0.0)) for s in (sound, kept)]
    lowered = 20 * math.log10(peaks[0] / peaks[1]) if peaks[1] else 0.0
    return Stored(10 * math.log10(max(power, 1e-20)), lowered)


def forces(player: Player) -> list[float]:
    """Force of each velocity, 0 to 127, over the softest note's, dB."""
    return [20 / math.log(10) * _range(player) * part for part in velocity_parts(player.velocity_curve)]


def level_at(velocity: int, chosen: tuple[int, ...], levels: list[float], forces: list[float]) -> float:
    """Level (dB) at a velocity, from the `levels` at the `chosen` ones; below them it follows the `forces` (dB)."""
    if velocity < chosen[0]:
        return levels[0] + forces[velocity] - forces[chosen[0]]
    return float(np.interp(velocity, chosen, levels))


def sfz_text(pack: Pack, stored: list[Stored]) -> str:
    """The SFZ file of a pack; `stored`: its samples, in the same order."""
    each = len(pack.velocities) * pack.robins
    lines = _head(pack)
    for number in range(len(pack.zones)):
        part = slice(number * each, (number + 1) * each)
        lines += _groups(pack, pack.samples[part], stored[part])
    return "\n".join(lines) + "\n"


def _head(pack: Pack) -> list[str]:
    """The lines above the first group."""
    bass, player, settings, quality = pack.bass, pack.bass.player, pack.settings, pack.settings.quality
    release = RELEASE_NEPERS / max(HANDS * player.hand_damping, 1e-9)
    release = min(max(release, SHORTEST_RELEASE), LONGEST_RELEASE)
    bend = round(100 * player.bend_range)
    return [
        f"{HEAD}{_line(bass.name)}",
        f"// {_line(bass.description)}",
        *([f"// Tuned to A = {bass.a4:g} Hz."] if bass.a4 != A4_HZ else []),
        f"// Free to use, also commercially, without naming anyone: see {LICENCE_FILE}.",
        "//",
        f"// Quality {quality.name}, {settings.rate} Hz, velocities {', '.join(map(str, pack.velocities))}.",
        "// A sample is, up to its end, what livebass renders for the note, velocity and seed that stand by it.",
        "// Levels are those of the engine: at the velocity of its group a sample plays as loud as the engine, and",
        "// amp_velcurve and volume follow the levels of the layers above and below. A level is the RMS of the first",
        f"// {LEVEL_TIME:g} s, in dB below full scale.",
        f"// The hand that stops a note damps it by about {HANDS * player.hand_damping:g} /s, which is"
        f" {RELEASE_NEPERS * 20 / math.log(10):.0f} dB in the time of ampeg_release.",
        "",
        "<control>",
        "set_cc7=127",  # volume: sfizz and others begin at 100, which is -4.2 dB
        f"default_path={FOLDER}/",
        "<global>",
        f"loop_mode=no_loop ampeg_release={release:.4g} amp_veltrack=100 bend_up={bend} bend_down={-bend}",
        "note_polyphony=1 note_selfmask=off",
    ]


def _groups(pack: Pack, samples: list[Sample], stored: list[Stored]) -> list[str]:
    """The groups of one zone, one per velocity layer."""
    player, chosen, zone = pack.bass.player, pack.velocities, samples[0].zone
    hardness = forces(player)
    by_layer = [range(k, k + pack.robins) for k in range(0, len(samples), pack.robins)]
    levels = [sum(stored[i].level for i in layer) / len(layer) for layer in by_layer]
    place = pack.bass.necks[zone.string].note_text(zone.fret)
    where = f"string {_line(pack.bass.strings[zone.string].name)}, {place}, {_technique(player, zone.string)}"
    lines = []
    for velocity, level, layer, (lowest, highest) in zip(chosen, levels, by_layer, edges(chosen), strict=True):
        points = sorted({*range(lowest, highest, CURVE_STEP), velocity, highest})
        gains = [level_at(v, chosen, levels, hardness) - level for v in points]  # dB
        maximum = max(gains)
        curve = [f"amp_velcurve_{v}={10 ** ((g - maximum) / 20):.5f}" for v, g in zip(points, gains, strict=True)]
        lines += [
            "",
            f"// {note_name(zone.note)}: {where}, velocity {velocity}, {level:.2f} dB",
            f"<group> lokey={zone.lowest} hikey={zone.highest} pitch_keycenter={zone.note}"
            f" lovel={lowest} hivel={highest} seq_length={pack.robins}",
            *(" ".join(curve[i : i + 6]) for i in range(0, len(curve), 6)),
        ]
        for i in layer:
            lines += [
                f"// seed {samples[i].seed}",
                f"<region> sample={samples[i].file} seq_position={samples[i].robin + 1}"
                f" volume={maximum + stored[i].lowered:.3f}",
            ]
    return lines


def _technique(player: Player, string: int) -> str:
    """The player's technique on a string."""
    if player.technique != "slap":
        return "plucked"
    return "struck by the thumb" if string < player.slapped_strings else "popped"


def _line(text: str) -> str:
    """`text` without line ends and other unprintable characters."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())
