"""Whether blocks are ready in time: `bench_live` measures, `bench_live_table.live_table` shows.

The native callback is asked for the blocks of a worst case (`worst_case`) in each tier and block size, several times.
"plain" figures are over all blocks of all runs, with whatever else the machine did. "quiet" ones take of each
block the least time of the runs: the same work, free from what disturbed one run. In between is the best run: the
one whose worst block took least. All are parts of a block's deadline, the time it lasts. Relief under overload is
off: every block is of the full tier. Unevenness is off too, so that runs are alike; nearly, where the callback
computes ahead of its clock.

The worst case is a script of messages for a `FakeDevice`, which runs the callback block after block without a pause.
The time of a block comes from the synth's own meter, inside the callback: Python's time between two blocks does not
count. A message is sent just before the block it falls into, as from a keyboard, never ahead. [main thread]

How far a quality tier is from another, heard: 24 notes over strings and neck, soft to hard, compared two by two.

Two numbers a note, both of the audio signal in the first `SPAN` seconds from the moment the finger has let go:
the error of the characteristic frequency, eq. 14 of Issanchou et al. (2018), and the log-spectral distance. Later
than that, and in detail, hard notes differ between tiers and between one contact rate and the next, as contacts
amplify the smallest difference; what is compared is how bright the sound is and where its energy lies.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from livebass import __version__
from livebass.analysis.sound import RANGE, characteristic_frequencies, spectrogram
from livebass.arrays import Floats
from livebass.bench.measure import Neighbours, Row, machine
from livebass.engine.engine import Engine
from livebass.engine.prepare import whole_contact_rate
from livebass.live.outputs import FakeDevice
from livebass.live.synth import LiveBass, Synth
from livebass.model.instrument import Instrument, speaking
from livebass.model.quality import QUALITIES, Quality, modes_for, quality_with
from livebass.preset.load import load_preset
from livebass.report.progress import Say, silent

RATE = 48_000  # Hz
EDGES = 10.0 ** np.linspace(-2.0, 1.5, 71)  # of the histograms, parts of the deadline; what is beyond is at the ends
MOONSHOT_PRESET, MOONSHOT_BLOCK, MOONSHOT_RATE = "paper-g", 128, 4e6  # Hz, of the contact steps


@dataclass(frozen=True)
class Extent:
    """How much is measured."""

    blocks: tuple[int, ...] = (32, 64, 128, 256, 512, 1024)  # frames
    tiers: tuple[str, ...] = tuple(QUALITIES)
    runs: int = 5  # of the tier that is made to play live
    other_runs: int = 3  # of the other tiers
    fit_runs: int = 3  # where fewer strings are tried
    line: float = 16 * 60 / 110 / 4  # s of sixteenths
    frets: tuple[int, ...] = (0, 2, 5, 7, 9, 12)  # where tiers are compared


USUAL = Extent()


def bench_live(
    preset: str = "jazz-finger", progress: Say | None = None, extent: Extent | None = None
) -> dict[str, Any]:  # fmt: skip
    """Everything, in about two minutes: numbers and text, as JSON has them. `progress` hears what comes next.

    "rows" has one for each tier and block size, "moonshot" one of a single string, "fidelity" how far each tier is
    from `reference`, "wanted" what is asked of them. Nothing else should run on the machine. Raises what
    `load_preset` and `Engine` raise. [main thread]
    """
    extent = extent or USUAL
    say = progress or silent
    bass = even(load_preset(preset))
    where, neighbours = machine(), Neighbours()
    rows = []
    for tier in extent.tiers:
        for block in extent.blocks:
            say(f"{tier}, {block} frames")
            rows.append(_tier_row(bass, tier, block, extent))
    say("one string, all modes, 4 MHz")
    moonshot = _moonshot(extent)
    shares = neighbours.shares()
    fidelity = {}
    for tier in extent.tiers:
        if tier != "reference":
            say(f"{tier} against reference")
            fidelity[tier] = _fidelity(bass, tier, extent)
    return {
        "livebass": __version__,
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "machine": where,
        **shares,
        "preset": preset,
        "rate_hz": RATE,
        "strings": len(bass.strings),
        "rows": rows,
        "moonshot": moonshot,
        "fidelity": fidelity,
        "wanted": _wanted(rows, moonshot, fidelity),
        "histogram_edges": EDGES.tolist(),
    }


def even(bass: Instrument) -> Instrument:
    """`bass` with a player who does the same thing twice."""
    return replace(bass, player=replace(bass.player, unevenness=0.0))


def block_times(bass: Instrument, quality: Quality, block: int, script: Script, runs: int) -> NDArray[np.int64]:
    """ns of each block of `script`, (runs, blocks), after a run that only warms up."""
    synth = Synth(script.rate, adaptive=False)
    synth.switch_to(LiveBass(bass, quality, script.rate))
    device = FakeDevice(synth)
    play_script(device, replace(script, frames=script.popped), block)
    times = []
    for _ in range(runs):
        silence(device, block)
        times.append(play_script(device, script, block))
    return np.array(times)


def block_figures(times: NDArray[np.int64], block: int, rate: int) -> dict[str, float]:
    """Parts of the deadline: of all blocks, of the run whose worst was the least, and of each block's best run."""
    loads = times * 1e-9 * rate / block
    quiet = loads.min(axis=0)
    return {
        "median": float(np.median(loads)),
        "p999": float(np.quantile(loads, 0.999)),
        "worst": float(loads.max()),
        "late": float((loads > 1.0).mean()),
        "best_run_worst": float(loads.max(axis=1).min()),
        "quiet_p999": float(np.quantile(quiet, 0.999)),
        "quiet_worst": float(quiet.max()),
        "quiet_worst_at_s": float(quiet.argmax() * block / rate),
    }


def _row(bass: Instrument, quality: Quality, block: int, strings: int, runs: int, line: float) -> Row:
    script = worst_case(bass, RATE, strings, line)
    times = block_times(bass, quality, block, script, runs)
    loads = times * 1e-9 * RATE / block
    counts = np.histogram(np.clip(loads, EDGES[0], EDGES[-1]), EDGES)[0]
    return {
        "tier": quality.name,
        "modes": quality.modes,
        "contact_rate_hz": whole_contact_rate(quality.contact_rate, RATE),
        "block": block,
        "deadline_us": block / RATE * 1e6,
        "strings": strings,
        "runs": runs,
        "blocks": int(times.size),
        **block_figures(times, block, RATE),
        "popped": block_figures(times[:, : script.popped // block], block, RATE),
        "histogram": counts.tolist(),
    }


def _tier_row(bass: Instrument, tier: str, block: int, extent: Extent) -> Row:
    runs = extent.runs if tier == "live" else extent.other_runs
    every = len(bass.strings)
    tried = {every: _row(bass, QUALITIES[tier], block, every, runs, extent.line)}

    def figure(key: str, strings: int) -> float:
        if strings not in tried:
            tried[strings] = _row(bass, QUALITIES[tier], block, strings, extent.fit_runs, extent.line)
        return float(tried[strings][key])

    fits = {key: most_that_fit(every, partial(figure, key)) for key in ("worst", "quiet_worst")}
    return tried[every] | {"fit": fits["worst"], "quiet_fit": fits["quiet_worst"]}


def most_that_fit(most: int, load: Callable[[int], float]) -> int:
    """The largest number up to `most` whose `load` is below 1, where more is never less; 0: not even one."""
    if load(most) < 1.0:
        return most
    fits, fails = 0, most
    while fails - fits > 1:
        middle = (fits + fails) // 2
        if load(middle) < 1.0:
            fits = middle
        else:
            fails = middle
    return fits


def _moonshot(extent: Extent) -> Row:
    """One string with all modes the grid has and contact steps half as fine as `reference`."""
    bass = even(load_preset(MOONSHOT_PRESET))
    quality = quality_with("reference", contact_rate=MOONSHOT_RATE)
    part = speaking(bass.strings[0], bass.necks[0], 0)
    modes = modes_for(quality, part.length, part.length, part.grid_points)
    row = _row(bass, quality, MOONSHOT_BLOCK, 1, extent.runs, extent.line)
    return row | {"tier": f"one string, {MOONSHOT_PRESET}", "modes": modes}


def _fidelity(bass: Instrument, tier: str, extent: Extent) -> dict[str, Any]:
    far = distance(bass, QUALITIES[tier], rate=RATE, frets=extent.frets)
    return {
        "span_s": SPAN,
        "notes": len(far.notes),
        "frequency": far.frequency,
        "worst_frequency": far.worst_frequency,
        "spectrum_db": far.spectrum_db,
        "heard_db": far.heard_db,
        "each": [vars(note) for note in far.notes],
    }


def _wanted(rows: list[Row], moonshot: Row, fidelity: dict[str, Any]) -> list[dict[str, Any]]:
    """What is asked and what was measured, as far as it was; "met" is judged by the plain figure."""
    out = []
    for row in rows:
        if (row["tier"], row["block"]) == ("live", 64):
            popped = row["popped"]
            what = "live, 64 frames, all strings popped at once"
            out += [
                _wish(f"{what}: worst block", 0.5, popped["worst"], popped),
                _wish(f"{what}: median block", 0.1, popped["median"]),
            ]
    if "live" in fidelity:
        far = fidelity["live"]
        out += [
            _wish("live from reference: characteristic frequency, mean", 0.05, far["frequency"]),
            _wish("live from reference: characteristic frequency, worst note", 0.2, far["worst_frequency"]),
            _wish("live from reference: log-spectral distance", 4.0, far["spectrum_db"], unit="dB"),
        ]
    label = f"moonshot, {MOONSHOT_BLOCK} frames: worst block"
    return [*out, _wish(label, 1.0, moonshot["worst"], moonshot)]


def _wish(what: str, limit: float, value: float, row: Row | None = None, unit: str = "%") -> dict[str, Any]:
    """`unit` "%": `limit` and values are parts of one; `row` has the other figures of a worst block."""
    more = {"best_run": row and row["best_run_worst"], "quiet": row and row["quiet_worst"]}
    return {"what": what, "unit": unit, "limit": limit, "value": value, **more, "met": value <= limit}


NOTE_ON, NOTE_OFF, CONTROL, ALL_SOUND_OFF = 0x90, 0x80, 0xB0, 120
POPPED = (0.0, 0.5)  # s, all open strings at velocity 127 at once; the second time while they sound
LINE_FROM = 1.0  # s
SIXTEENTH = 60 / 110 / 4  # s
# One row a round over the strings: from one to the next never up by a fourth or two, so that no note of the new
# fret is one that another string still plays from the old one, which would take it.
ROUNDS = ((0, 127), (3, 100), (7, 127), (2, 115))  # fret, velocity
REST = 0.3  # s of silence after each run
Message = tuple[int, int, int, int]  # frame, status, first, second


@dataclass(frozen=True)
class Script:
    """Messages in the order of their frames, from frame 0 on."""

    rate: int
    messages: tuple[Message, ...]
    popped: int  # frames of it with nothing but all strings popped at once
    frames: int


def worst_case(bass: Instrument, rate: int, strings: int, line: float = len(ROUNDS) * 4 * SIXTEENTH) -> Script:
    """The first `strings` strings of `bass` popped at once, again, then `line` s of sixteenths round over them."""
    keys = [string.open_note for string in bass.strings[:strings]]
    messages: list[Message] = [
        (round(beat * rate), NOTE_ON, key, 127) for beat in POPPED for key in keys
    ]  # fmt: skip
    playing = list(keys)
    count = int(line / SIXTEENTH + 1e-9)
    for k in range(count):
        frame, i = round((LINE_FROM + k * SIXTEENTH) * rate), k % strings
        fret, velocity = ROUNDS[k // strings % len(ROUNDS)]
        messages.append((frame, NOTE_OFF, playing[i], 0))
        playing[i] = keys[i] + fret
        messages.append((frame, NOTE_ON, playing[i], velocity))
    return Script(rate, tuple(messages), round(LINE_FROM * rate), round((LINE_FROM + count * SIXTEENTH) * rate))


def play_script(device: FakeDevice, script: Script, block: int) -> NDArray[np.int64]:
    """Times of the blocks of `script` from the next one on, ns; `silence` first, for runs that are alike."""
    synth, messages = device.synth, script.messages
    metered, busy, begin = bool(synth.record["clock"][0]), synth.record["busy"], int(synth.record["frame"][0])
    times, out = np.zeros(-(-script.frames // block), np.int64), np.zeros(block, np.float32)
    sent, collected = 0, gc.isenabled()
    gc.disable()
    try:
        for k in range(len(times)):
            end = (k + 1) * block
            while sent < len(messages) and messages[sent][0] < end:
                frame, status, first, second = messages[sent]
                synth.send(status, first, second, begin + frame)
                sent += 1
            began = time.perf_counter_ns()
            device.fill(out)
            times[k] = busy[0] if metered else time.perf_counter_ns() - began
    finally:
        if collected:
            gc.enable()
    return times


def silence(device: FakeDevice, block: int) -> None:
    """Ends all sound and waits for it, in blocks of `block` frames."""
    device.synth.send(CONTROL, ALL_SOUND_OFF, 0)
    for _ in range(-(-round(REST * device.synth.rate) // block)):
        device.block(block)


SPAN = 0.3  # s of each note
FRETS = (0, 2, 5, 7, 9, 12)
VELOCITIES = (20, 45, 64, 85, 106, 127)
NOTE_ON, CONTROL, ALL_SOUND_OFF = 0x90, 0xB0, 120
GAP = 0.05  # s between notes, silent


@dataclass(frozen=True)
class NoteDistance:
    """One note in two tiers."""

    string: str
    fret: int
    velocity: int
    frequency: float  # relative error of the characteristic frequency, median over the frames of a spectrogram
    spectrum_db: float  # log-spectral distance over all bins
    heard_db: float  # the same over the bins in which either sound is within RANGE: no bin is equal for being silent


@dataclass(frozen=True)
class Distance:
    """All notes."""

    notes: tuple[NoteDistance, ...]

    @property
    def frequency(self) -> float:
        """Mean over the notes."""
        return float(np.mean([n.frequency for n in self.notes]))

    @property
    def worst_frequency(self) -> float:
        return max(n.frequency for n in self.notes)

    @property
    def spectrum_db(self) -> float:
        return float(np.mean([n.spectrum_db for n in self.notes]))

    @property
    def heard_db(self) -> float:
        return float(np.mean([n.heard_db for n in self.notes]))


def distance(
    bass: Instrument,
    quality: Quality,
    other: Quality = QUALITIES["reference"],
    rate: int = 48_000,
    frets: tuple[int, ...] = FRETS,
) -> Distance:
    """`quality` from `other` on every string of `bass` at `frets`, one velocity each: over six, all there are.

    The player's unevenness is left out. Raises ValueError for what `Engine` cannot play. [main thread]
    """
    even = replace(bass, player=replace(bass.player, unevenness=0.0))
    notes = []
    for i, string in enumerate(bass.strings):
        alone = replace(even, strings=(string,), necks=(bass.necks[i],))
        play = [(fret, VELOCITIES[(5 * k + 2 * i + 5) % 6]) for k, fret in enumerate(frets)]
        pairs = zip(_sounds(alone, quality, rate, play), _sounds(alone, other, rate, play), strict=True)
        for (fret, velocity), (one, two) in zip(play, pairs, strict=True):
            spectrum, heard = log_spectral_distance(one, two, rate)
            error = frequency_error(one, two, rate)
            notes.append(NoteDistance(string.name, fret, velocity, error, spectrum, heard))
    return Distance(tuple(notes))


def _sounds(bass: Instrument, quality: Quality, rate: int, play: list[tuple[int, int]]) -> list[Floats]:
    """SPAN s of each (fret, velocity) on the only string of `bass`, from the moment the finger or thumb is gone."""
    engine = Engine(bass, quality, rate, workers=1)
    player = bass.player
    struck = player.technique == "slap" and player.slapped_strings > 0
    held = round((player.strike_time if struck else player.pull_time) * rate)
    out = []

    def send(*message: int) -> None:
        engine.send(np.array([engine.frame]), np.array([message], np.uint8))

    for fret, velocity in play:
        send(NOTE_ON, bass.strings[0].open_note + fret, velocity)
        engine.process(held)
        out.append(engine.process(round(SPAN * rate))[0])
        send(CONTROL, ALL_SOUND_OFF, 0)
        engine.process(round(GAP * rate))
    return out


def frequency_error(sound: Floats, other: Floats, rate: int) -> float:
    """Relative error of the characteristic frequency of `sound`, median over the frames in which both sound."""
    nu, wanted = characteristic_frequencies(sound, rate), characteristic_frequencies(other, rate)
    both = np.isfinite(nu) & np.isfinite(wanted)
    if not both.any():
        raise ValueError("nothing sounds: there is nothing to compare")
    return float(np.median(np.abs(nu - wanted)[both] / wanted[both]))


def log_spectral_distance(sound: Floats, other: Floats, rate: int) -> tuple[float, float]:
    """Root mean square over bins of the difference of two spectra in dB, then the mean over frames, dB.

    Both are raised to RANGE below the loudest bin of `other`. The second value leaves out, frame by frame, the bins in
    which both are as low as that: there two sounds would agree by being silent. Raises ValueError where `other` is.
    """
    a, b = spectrogram(sound, rate), spectrogram(other, rate)
    if not b.any():
        raise ValueError("nothing sounds: there is nothing to compare")
    floor = b.max() * 10 ** (-RANGE / 20)
    squared = (20 * np.log10(np.maximum(a, floor) / np.maximum(b, floor))) ** 2
    heard = np.maximum((np.maximum(a, b) > floor).sum(axis=1), 1)
    return float(np.sqrt(squared.mean(axis=1)).mean()), float(np.sqrt(squared.sum(axis=1) / heard).mean())
