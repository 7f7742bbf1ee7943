"""How near a held string that nothing touches comes to what this machine can do: `livebass bench render`.

It moves many frames at once (kernels/string/runs.py). The tables below count the multiplications and additions that
these need, a sum and a product together as one; what they load and store is left out. numpy's product of matrices says
how many of them a core does in a second, float32 and float64. The time they need at that rate is the limit: no code
with the same arithmetic is faster.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from livebass.engine.engine import Engine
from livebass.kernels.string.records import LONG_RUN, QUARTET
from livebass.lab.bench.measure import Clock, Result
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset

RATE = 48_000  # Hz
NOTE, VELOCITY = 28, 40  # an open E, soft: it touches no fret
ATTACK, PIECE, PIECES = 0.5, 0.25, 20  # s, s, and how many pieces are timed
SIZE = 384  # rows and columns of the matrices
# Multiply-adds of a run for each mode, by its frames: of u or v, the same in float32 at any rate, of each pickup, of u
# alone in float64, and of each pickup there
RUNS = {QUARTET: (23, 0, 4, 11, 3), LONG_RUN: (27, 32, 16, 23, 9)}
# Of u and v for the slope, and for the exchange between them; in a look ahead of u, and of each contact point
SLOPE, EXCHANGED, AHEAD, POINT = 8, 24, 24, 3


def measure_limit(bass: str = "jazz-finger", pieces: int = PIECES) -> Result:
    """Returns the time of a frame of a held string and its limit, ns, as medians of `pieces`. [main thread]"""
    engine = Engine(load_preset(bass), QUALITIES["live"], RATE, workers=1)
    still = Engine(load_preset(bass), QUALITIES["live"], RATE, workers=1)
    engine.send(np.zeros(1, np.int64), np.array([(0x90, NOTE, VELOCITY)], np.uint8))
    frames = round(PIECE * RATE)
    for each in (engine, still):
        each.process(round(ATTACK * RATE))
    rows = []
    for _ in range(pieces):
        peak = {kind: peak_rate(kind) for kind in ("float32", "float64")}
        times = []
        for each in (engine, still):
            clock = Clock()
            with clock:
                each.process(frames)
            times.append(clock.processor[0] / frames * 1e9)
        needed = multiply_adds(engine)
        limit = sum(needed[kind] / peak[kind] for kind in peak) * 1e9
        rows.append((times[0] - times[1], limit, sum(needed.values()), *peak.values()))
    frame, limit, adds, single, double = (float(x) for x in np.median(rows, axis=0))
    return {
        "frame_ns": frame,
        "limit_ns": limit,
        "part": limit / frame,
        "multiply_adds": adds,
        "float32_per_s": single,
        "float64_per_s": double,
    }


def multiply_adds(engine: Engine) -> dict[str, float]:
    """Multiply-adds that a frame of the sounding string needs, float32 and float64."""
    voice = next(v for v in engine.voices if v.sounding())
    slot = voice.slots[int(voice.record["slot"][0])]
    op = engine.pool.records[engine.voices.index(voice)][int(slot["fret"])]
    u, v = int(slot["active"]), int(slot["v_active"])
    pickups, split = int(voice.record["pickups"][0]), int(op["split"])
    frames = LONG_RUN if slot["gentle"] else QUARTET
    moved, turned, sensed, displaced, seen = RUNS[frames]
    low, low_v = min(u, split), min(v, split)
    high, high_v = u - low, v - low_v
    heard = sensed * pickups
    double: float = moved * (low + low_v) + (displaced + seen * pickups) * low
    single: float = (turned + heard) * (u + v) + moved * (high + high_v)
    if not turned:  # a quartet senses modes in their own width
        double, single = double + heard * (low + low_v), single - heard * (low + low_v)
    double += SLOPE * low + EXCHANGED * min(int(op["turned"]), max(u, v))
    double += (AHEAD + POINT * int(op["points"])) * low * frames / LONG_RUN
    single += SLOPE * min(high, high_v)
    return {"float32": single / frames, "float64": double / frames}


def peak_rate(kind: str) -> float:
    """Multiply-adds that one core does in a second, by a product of matrices."""
    a = np.ones((SIZE, SIZE), kind)
    best = np.inf
    for _ in range(3):
        begin = time.process_time()
        a @ a
        best = min(best, time.process_time() - begin)
    return float(SIZE**3 / best)


def limit_lines(found: dict[str, Any]) -> list[str]:
    """Returns the lines of a table for `measure_limit`."""
    return [
        f"a held string, live: {found['frame_ns']:.0f} ns a frame; its {found['multiply_adds']:.0f} multiply-adds take "
        f"{found['limit_ns']:.0f} ns at this core's {found['float32_per_s'] / 1e9:.0f} (float32) and "
        f"{found['float64_per_s'] / 1e9:.0f} (float64) in a ns: {found['part']:.0%} of the limit",
    ]
