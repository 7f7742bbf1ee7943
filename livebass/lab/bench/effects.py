"""`livebass bench effects`: the part of a block's time that each effect behind the DI takes.

Noise goes through the effects of a bass, block by block. Each block's figure is its least over several runs, so other
programs count little; the table shows the median and the highest of 99 in 100 blocks.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from livebass.engine.engine import Engine
from livebass.kernels.effects.chain import add_effects
from livebass.lab.bench.measure import Result, Row, heading, machine_line
from livebass.model.instrument import Effects
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset
from livebass.report.progress import Say, silent
from livebass.report.text import columns

RATE = 48_000  # Hz
WANTED = 0.04  # of a block, at most
LEVEL = 0.3  # of full scale, rms
KINDS: dict[str, dict[str, Any]] = {
    "compression": {"compression": 0.5},
    "drive": {"drive": 0.5},
    "drive with a clean blend": {"drive": 0.5, "clean_blend": 0.5},
    "equaliser, four bands": {"eq_bass": 4.0, "eq_low_mid": -4.0, "eq_high_mid": 3.0, "eq_treble": 3.0},
    "cabinet, closed-4x10": {"cabinet": "closed-4x10"},
    "cabinet, closed-8x10": {"cabinet": "closed-8x10"},
    "cabinet, vented-1x15": {"cabinet": "vented-1x15"},
    "limiter": {"limiter": "on"},
}
AMP, ALL = "amp: all but compression", "all"


@dataclass(frozen=True)
class Extent:
    """Extent of a measurement."""

    block: int = 64  # frames
    blocks: int = 3000
    runs: int = 7


FULL = Extent()


def bench_effects(progress: Say = silent, extent: Extent = FULL) -> Result:
    """Measures each effect in a few seconds; run nothing else meanwhile. `progress` gets each next step.

    "rows" has one row per effect, and two for all of them with the largest cabinet, without and with the compressor:
    "median" and "p99", parts of a block's time. [main thread]
    """
    every = {name: value for kind in KINDS.values() for name, value in kind.items()} | {"cabinet": "closed-8x10"}
    rows: list[Row] = []
    for name, knobs in {**KINDS, AMP: every | {"compression": 0.0}, ALL: every}.items():
        progress(name)
        least = _times(Effects(**knobs), extent).min(axis=0) * 1e-9 * RATE / extent.block
        rows.append({"name": name, "median": float(np.median(least)), "p99": float(np.quantile(least, 0.99))})
    return heading() | {
        "rate_hz": RATE,
        "block": extent.block,
        "rows": rows,
        "wanted": {"most": WANTED, "met": rows[-2]["median"] <= WANTED},
    }


def _times(effects: Effects, extent: Extent) -> np.ndarray:
    """Times of every block, ns, (runs, blocks)."""
    bass = replace(load_preset("jazz-finger"), effects=effects)
    noise = np.random.default_rng(1).standard_normal((extent.blocks, extent.block)) * LEVEL
    times = np.zeros((extent.runs, extent.blocks))
    for run in range(extent.runs):
        engine = Engine(bass, QUALITIES["live"], RATE)
        address, sound = engine.bass.effects, noise.astype(np.float32)
        for k in range(extent.blocks):
            began = time.perf_counter_ns()
            add_effects(address, sound[k].ctypes.data, k * extent.block, extent.block)
            times[run, k] = time.perf_counter_ns() - began
    return times


def table(result: Result) -> str:
    """Returns the figures of `bench_effects` as text."""
    wanted = result["wanted"]
    head = ("effect", "median", "99 of 100")
    cells = [(row["name"], f"{row['median']:.1%}", f"{row['p99']:.1%}") for row in result["rows"]]
    verdict = "met" if wanted["met"] else "missed"
    return "\n".join(
        [
            f"part of a block of {result['block']} frames at {result['rate_hz'] / 1e3:g} kHz",
            *columns([head, *cells]),
            f"wanted: amp at most {wanted['most']:.0%}: {verdict}",
            machine_line(result),
        ]
    )
