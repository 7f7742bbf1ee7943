"""Renders a score with an instrument to files or an array, as fast as the machine allows."""

from __future__ import annotations

import math
import os
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from livebass.engine.basses import Basses
from livebass.engine.engine import Block, Engine, Playing, Report, check_tail, scaled
from livebass.engine.engine import mix_strings as mix_strings
from livebass.engine.engine import single as single
from livebass.files.whole import Transaction, checked_place, output_error
from livebass.kernels.player.messages import NOTE_ON
from livebass.model.instrument import Effects, Instrument
from livebass.model.quality import Quality
from livebass.score.low_keys import with_low_notes
from livebass.score.score import Score
from livebass.sound.audiofile import AudioWriter, encoding
from livebass.sound.meter import LoudnessMeter

CEILING = -1.0  # dB re full scale: highest peak after normalizing
Sound = tuple[NDArray[np.float32], NDArray[np.float32] | None]  # of each string, and the mix behind the effects
DEFAULT_TAIL = 1.0  # s, guess of the engine's tail, to show progress


class RenderError(ValueError):
    """The instrument produced NaN or infinity; one line."""


@dataclass(frozen=True, kw_only=True)
class RenderReport(Report):
    """Counts and measures of a finished render."""

    files: tuple[Path, ...]  #: the mix, then the stems
    clipped: int  #: samples beyond full scale
    duration_s: float
    wall_s: float
    peak_db: float  #: of the mix, dB re full scale; -inf for silence
    gain_db: float = 0.0  #: applied on writing
    loudness: float | None = None  #: LUFS, of the mix as written, if normalized; -inf for silence
    switches: int = 0  #: note-ons of key switches, which are not notes


def stem_paths(out: Path, instrument: Instrument, directory: Path | None = None) -> list[Path]:
    """Returns a path per string: song.wav -> song.E.wav, song.A.wav ... beside it or in `directory`."""
    return [(directory or out.parent) / f"{out.stem}.{name}{out.suffix}" for name in string_names(instrument)]


def string_names(instrument: Instrument) -> list[str]:
    """Returns a unique name per string that can be part of a file name."""
    names = ["".join(c if c.isalnum() or c in "#-_" else "_" for c in s.name) for s in instrument.strings]
    if len({name.casefold() for name in names}) < len(names):
        names = [f"{number}-{name}" for number, name in enumerate(names, 1)]
    return names


class RenderOptions(TypedDict, total=False):
    """The options of `render_to_file` by name, which its docstring describes."""

    format: str | None
    bits: str | None
    stems: Path | bool
    tail: float | None
    gain_db: float
    normalize: float | None
    seed: int
    basses: Mapping[int, Instrument] | None


def render_to_file(
    instrument: Instrument,
    score: Score,
    out: str | os.PathLike[str],
    *,
    quality: Quality,
    rate: int,
    progress: Callable[[float], None] | None = None,
    files: Transaction | None = None,
    **options: Unpack[RenderOptions],
) -> RenderReport:
    """Renders a score to a mono sound file. All files appear at the end, or none.

    The same arguments give the same bytes on the same kind of processor. With "float" bits, the sum of all stems in
    float32, string after string, equals the mix bit for bit, if the bass has no effects. Call it in the main thread.

    Args:
        instrument: The bass.
        score: The notes.
        out: The file; its extension chooses the format.
        quality: One of `QUALITIES`, or from `quality_with`.
        rate: Sample rate, Hz; it must be the score's.
        progress: Called with the fraction done, 0 to 1.
        files: A transaction at whose end the files appear, instead of at the end of this call.

    Keyword Args:
        format: "wav", "flac" or "ogg"; by default the file's extension.
        bits: "16", "24" (the default) or "float".
        stems: True writes a file per string beside the mix, a path writes them to that directory. All basses must have
            equally many strings.
        tail: Seconds to play after the score's end; by default until the strings are still.
        gain_db: Gain, dB.
        normalize: Integrated loudness of the mix, LUFS, in place of `gain_db`. No peak rises above -1 dB.
        seed: Chooses the small differences from note to note.
        basses: Other basses by program, from 0, for the program changes of the score.

    Raises:
        ValueError: An argument out of its limits, or another rate than the score's; as RenderError, the bass produced
            NaN.
        OutputError: A file cannot be written.
    """
    stems, tail, normalize = options.get("stems", False), options.get("tail"), options.get("normalize")
    gain_db, basses = options.get("gain_db", 0.0) + dict(instrument.played).get("gain", 0.0), options.get("basses")
    started = time.perf_counter()
    out = Path(out)
    if score.rate != rate:
        raise ValueError(f"the score is in frames of {score.rate} Hz, the render in {rate} Hz")
    check_tail(tail)
    kind = encoding(out, rate, options.get("format"), options.get("bits"))
    expected = score.end_frame + round((DEFAULT_TAIL if tail is None else tail) * rate)
    kind.check_length(score.end_frame + round((tail or 0.0) * rate), out)
    score = with_low_notes(score, instrument)
    paths = stem_paths(out, instrument, stems if isinstance(stems, Path) else None) if stems else []
    strings = sorted({len(bass.strings) for bass in (instrument, *(basses or {}).values())})
    if paths and len(strings) > 1:
        raise ValueError(f"{out}: its basses have {' and '.join(map(str, strings))} strings: leave out --stems")
    for path in (out, *paths):
        checked_place(path)  # before seconds of work
    meter = None if normalize is None else LoudnessMeter(rate)
    engine = _player(instrument, score, quality, options.get("seed", 0), basses)
    peak, done, rendered = 0.0, 0, 0

    def tick(frames: int) -> None:
        nonlocal rendered
        rendered += frames
        if progress:
            progress(min(1.0, rendered / max(1, expected)))

    with Transaction() if files is None else nullcontext(files) as files, ExitStack() as ends:
        blocks = _blocks(engine, score, tail, [instrument, *(basses or {}).values()])
        sound = _scale(blocks, 10 ** (gain_db / 20) if meter is None else 1.0, rate, tick)
        if meter is not None and normalize is not None:
            sound, gain_db = ends.enter_context(_normalize(sound, meter, normalize, out))
        writers = [AudioWriter(files, path, kind) for path in paths]
        mix_writer = AudioWriter(files, out, kind)
        for sounds, wet in sound:
            mix = mix_strings(sounds) if wet is None else wet
            for writer, string in zip(writers, sounds, strict=bool(paths)):
                writer.write(string)
            mix_writer.write(mix)
            peak = max(peak, float(np.max(np.abs(mix), initial=0.0)))
            done += len(mix)
        for writer in (*writers, mix_writer):
            writer.close()
    counts = engine.report()
    return RenderReport(
        **vars(replace(counts, transposed=counts.transposed + score.raised)),
        files=(out, *paths),
        clipped=mix_writer.clipped,
        duration_s=done / rate,
        wall_s=time.perf_counter() - started,
        peak_db=20 * math.log10(peak) if peak else -math.inf,
        gain_db=gain_db,
        loudness=None if meter is None else meter.loudness() + gain_db,
        switches=_count_switches(score, instrument),
    )


def render_to_array(
    instrument: Instrument,
    score: Score,
    quality: Quality,
    *,
    tail: float | None = None,
    seed: int = 0,
    basses: Mapping[int, Instrument] | None = None,
) -> NDArray[np.float64]:
    """Renders a score at its own rate, without the effects of the bass, which work on the mix.

    Args:
        instrument: The bass.
        score: The notes.
        quality: One of `QUALITIES`, or from `quality_with`.
        tail: Seconds to play after the score's end; by default until the strings are still.
        seed: Chooses the small differences from note to note.
        basses: Other basses by program, from 0, for the program changes of the score.

    Returns:
        float64 of shape (n_strings, n_frames), lowest string first, full scale 1; the mix is the sum over strings. It
        has a row for each string of the bass with most strings.

    Raises:
        ValueError: A `tail` that is not a time, or a neck that nobody could play.

    Example:
        >>> from livebass import QUALITIES, load_preset, single_note
        >>> low_e = single_note(28, 100, 0.1, 48000)
        >>> render_to_array(load_preset("slap"), low_e, QUALITIES["live"], tail=0.1).shape
        (4, 9600)
    """
    score = with_low_notes(score, instrument)
    player = _player(instrument, score, quality, seed, basses)
    return np.concatenate([np.zeros((player.strings, 0)), *player.play(score, tail)], axis=1)


def _player(
    instrument: Instrument, score: Score, quality: Quality, seed: int, basses: Mapping[int, Instrument] | None
) -> Playing:
    """Prepares the bass for `score`, and the basses that its program changes choose."""
    engine = Engine(instrument, quality, score.rate, seed)
    chosen = {program: basses[program] for _, program in score.changes if program in basses} if basses else {}
    return Basses(engine, chosen) if chosen else engine


def _count_switches(score: Score, instrument: Instrument) -> int:
    """Number of note-ons in `score` that press key switches of the bass."""
    struck = score.messages[score.messages[:, 0] & 0xF0 == NOTE_ON, 1]
    return int(np.count_nonzero(np.isin(struck, list(instrument.switches))))


@contextmanager
def _normalize(
    blocks: Iterator[Sound], meter: LoudnessMeter, target: float, out: Path
) -> Iterator[tuple[Iterator[Sound], float]]:
    """Yields `blocks` at the `target` loudness (LUFS), and its gain, dB; lower if the peak would exceed CEILING.

    The blocks go through an unnamed file beside `out`: an hour of sound does not fit into memory.
    Raises OutputError if it does not fit there.
    """
    folder = checked_place(out).parent
    with ExitStack() as ends:
        sizes, peak = [], 0.0
        try:
            kept = ends.enter_context(tempfile.TemporaryFile(dir=folder))
            for strings, wet in blocks:
                mix = mix_strings(strings) if wet is None else wet
                meter.add(mix)
                peak = max(peak, float(np.max(np.abs(mix), initial=0.0)))
                sizes.append((*strings.shape, wet is not None))
                kept.write(strings.tobytes())
                kept.write(b"" if wet is None else wet.tobytes())
            kept.seek(0)
        except OSError as error:
            raise output_error(out, error) from None
        loudness = meter.loudness()
        silent = math.isinf(loudness)  # or nearly so
        gain_db = 0.0 if silent else min(target - loudness, CEILING - 20 * math.log10(peak))
        gain = np.float32(10 ** (gain_db / 20))

        def again() -> Iterator[Sound]:
            for count, frames, behind in sizes:
                data = kept.read((count + behind) * frames * np.dtype(np.float32).itemsize)
                rows = np.frombuffer(data, np.float32).reshape(count + behind, frames) * gain
                yield rows[:count], rows[count] if behind else None

        yield again(), gain_db


def _blocks(engine: Playing, score: Score, tail: float | None, basses: list[Instrument]) -> Iterator[Block]:
    """Plays `score` on `engine`; with the mix after the effects if any of the `basses` has some."""
    if any(bass.effects != Effects() for bass in basses):
        return engine.play_with_mix(score, tail)
    return ((strings, None) for strings in engine.play(score, tail))


def _scale(blocks: Iterator[Block], gain: float, rate: int, tick: Callable[[int], None]) -> Iterator[Sound]:
    """Applies the gain to each block, and ticks after its use. Raises RenderError for NaN and infinity."""
    frame = 0
    for block, wet in blocks:
        strings, finite = scaled(block, gain)
        mix, whole = (None, True) if wet is None else scaled(wet, gain)
        if not (finite and whole):
            raise RenderError(f"the sound is not finite near {frame / rate:.3f} s; please report the preset")
        yield strings, mix
        frame += block.shape[1]
        tick(block.shape[1])
