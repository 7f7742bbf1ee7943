"""Renders a score with an instrument into files or an array, as fast as the machine allows."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from livebass.audiofile import AudioWriter, encoding
from livebass.engine.basses import Basses
from livebass.engine.engine import Engine, Playing, check_tail
from livebass.files import Transaction, checked_place
from livebass.model.instrument import Instrument
from livebass.model.quality import Quality
from livebass.score import Score

USUAL_TAIL = 1.0  # s, guess of the engine's own tail, for the progress shown


class RenderError(ValueError):
    """The instrument gave NaN or infinity; one line."""


@dataclass(frozen=True)
class RenderReport:
    """Counts and measures of a finished render."""

    files: tuple[Path, ...]  # the mix, then the stems
    notes: int
    transposed: int  # notes moved by octaves into the range
    dropped: int  # notes the instrument could not play
    stolen: int  # notes whose string another took while they sounded
    weakened: int  # times that a motion was scaled back to what a string bears: 0 unless something is wrong
    clipped: int  # samples beyond full scale
    duration_s: float
    wall_s: float
    peak_db: float  # of the mix, dB re full scale; -inf for silence


def stem_paths(out: Path, instrument: Instrument, directory: Path | None = None) -> list[Path]:
    """Returns a path a string: song.wav -> song.E.wav, song.A.wav ... beside it or in `directory`."""
    return [(directory or out.parent) / f"{out.stem}.{name}{out.suffix}" for name in string_names(instrument)]


def string_names(instrument: Instrument) -> list[str]:
    """Returns a name a string that differs from the others and can be part of a file's name."""
    names = ["".join(c if c.isalnum() or c in "#-_" else "_" for c in s.name) for s in instrument.strings]
    if len({name.casefold() for name in names}) < len(names):
        names = [f"{number}-{name}" for number, name in enumerate(names, 1)]
    return names


def render_to_file(
    instrument: Instrument,
    score: Score,
    out: str | os.PathLike[str],
    *,
    quality: Quality,
    rate: int,
    format: str | None = None,
    bits: str | None = None,
    stems: Path | bool = False,
    tail: float | None = None,
    gain_db: float = 0.0,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    files: Transaction | None = None,
    basses: Mapping[int, Instrument] | None = None,
) -> RenderReport:
    """Renders `score` into the file `out`, mono, `rate` Hz; all files appear at the end, or none.

    `format` is "wav", "flac" or "ogg", by default what `out` ends in; `bits` "16", "24" (the default) or
    "float". `stems` adds a file a string, beside `out` or in that directory; in "float" their sum in float32,
    string after string, is bitwise the mix. `tail` s are played after the last event (None: until the strings
    are still). `basses`, by General MIDI's program from 0, are those that program changes of the score choose; by
    default none do. `progress` is called with the fraction done. With `files` given, the files appear when that
    transaction ends. The same arguments give the same bytes on the same kind of processor. Raises ValueError,
    OutputError, RenderError. [main thread]
    """
    started = time.perf_counter()
    out = Path(out)
    if score.rate != rate:
        raise ValueError(f"the score is in frames of {score.rate} Hz, the render in {rate} Hz")
    check_tail(tail)
    kind = encoding(out, rate, format, bits)
    expected = score.end_frame + round((USUAL_TAIL if tail is None else tail) * rate)
    kind.check_length(score.end_frame + round((tail or 0.0) * rate), out)
    paths = stem_paths(out, instrument, stems if isinstance(stems, Path) else None) if stems else []
    for path in (out, *paths):
        checked_place(path)  # now, not after seconds of work
    engine = _player(instrument, score, quality, seed, basses)
    peak, done = 0.0, 0
    with Transaction() if files is None else nullcontext(files) as files:
        writers = [AudioWriter(files, path, kind) for path in paths]
        mix_writer = AudioWriter(files, out, kind)
        for strings in _scaled(engine.play(score, tail), 10 ** (gain_db / 20), rate):
            mix = mixed(strings)
            for writer, string in zip(writers, strings, strict=bool(paths)):
                writer.write(string)
            mix_writer.write(mix)
            peak = max(peak, float(np.max(np.abs(mix), initial=0.0)))
            done += len(mix)
            if progress:
                progress(min(1.0, done / max(1, expected)))
        for writer in (*writers, mix_writer):
            writer.close()
    report = engine.report()
    return RenderReport(
        files=(out, *paths),
        notes=report.notes,
        transposed=report.transposed,
        dropped=report.dropped,
        stolen=report.stolen,
        weakened=report.weakened,
        clipped=mix_writer.clipped,
        duration_s=done / rate,
        wall_s=time.perf_counter() - started,
        peak_db=20 * math.log10(peak) if peak else -math.inf,
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
    """Renders `score` at its own rate: (n_strings, n_frames), full scale 1; the mix is the sum over strings.

    `basses`, by General MIDI's program from 0, are those that program changes of the score choose.
    """
    blocks = _player(instrument, score, quality, seed, basses).play(score, tail)
    return np.concatenate([np.zeros((len(instrument.strings), 0)), *blocks], axis=1)


def _player(
    instrument: Instrument, score: Score, quality: Quality, seed: int, basses: Mapping[int, Instrument] | None
) -> Playing:
    """Prepares what plays `score`: the bass, and those that its program changes choose."""
    engine = Engine(instrument, quality, score.rate, seed)
    chosen = {program: basses[program] for _, program in score.changes if program in basses} if basses else {}
    return Basses(engine, chosen) if chosen else engine


def mixed(strings: NDArray[np.float32]) -> NDArray[np.float32]:
    """Adds (n_strings, n_frames) string after string in float32, so that stems add up to the mix: (n_frames,)."""
    mix = strings[0].copy()
    for string in strings[1:]:
        mix += string
    return mix


def single(sound: NDArray[np.float64]) -> NDArray[np.float32]:
    """Returns a sound in float32, with 0 for what is below its normal numbers, as the audio thread has it."""
    out = sound.astype(np.float32)
    out[np.abs(out) < np.finfo(np.float32).tiny] = 0.0
    return out


def _scaled(blocks: Iterator[NDArray[np.float64]], gain: float, rate: int) -> Iterator[NDArray[np.float32]]:
    """Applies the gain to each block. Raises RenderError for NaN and infinity."""
    frame = 0
    for block in blocks:
        if not np.isfinite(block).all():
            raise RenderError(f"the sound is not finite near {frame / rate:.3f} s; please report the preset")
        yield single(block * gain)
        frame += block.shape[1]
