"""One string of a bass, played frame by frame, and its energy."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from livebass import QUALITIES
from livebass.engine.engine import Engine
from livebass.engine.prepare import modal_row, play_frames
from livebass.kernels.string import tension
from livebass.kernels.string.records import BLOCK, EVENT, GAIN
from livebass.model.bench import change_bass
from livebass.model.instrument import Instrument
from livebass.model.neck import Admittance
from livebass.model.quality import MAX_MODES
from support.own_basses import load_preset
from support.strings import turn_axes, yielding

RATE = 48000
YIELDS = " that yields"  # after the name of a preset: with necks made by `yielding`
TURNED = " with turned axes"  # the same: with necks made by `turn_axes`
FRETS_OUT = " that frets out"  # the same: with a very low action, so that high notes lie on fret 20
RINGS_ON = " that rings on"  # the same: strings with hardly any loss, on rigid necks


@cache
def engine(preset: str, quality: str = "live") -> Engine:
    bass = made_of(preset.removesuffix(RINGS_ON))
    if preset.endswith(RINGS_ON):
        lossless = {"measured_dampings": (1e-9,) * MAX_MODES, "extra_damping": 0.0, "extra_damping_slope": 0.0}
        strings = tuple(replace(s, **lossless) for s in bass.strings)  # type: ignore[arg-type]
        necks = tuple(replace(n, admittance=Admittance(), stop_conductance=0.0) for n in bass.necks)
        bass = replace(bass, strings=strings, necks=necks)
    return Engine(bass, QUALITIES[quality], RATE)


def made_of(preset: str) -> Instrument:
    """The bass of a preset, its necks changed if the name says so."""
    for ending, change in ((YIELDS, yielding), (TURNED, turn_axes), (FRETS_OUT, lowered)):
        if preset.endswith(ending):
            return change(load_preset(preset.removesuffix(ending)))
    return load_preset(preset)


def lowered(bass: Instrument, action: float = 0.7) -> Instrument:
    """The bass with `action` mm under its first string."""
    return change_bass(bass, {"action": action + 1e3 * bass.necks[0].fret_heights[11]})


class Played:
    """One string, frame by frame."""

    def __init__(self, preset: str, i: int, quality: str = "live") -> None:
        made = engine(preset, quality).another()
        self.voice, self.ops, self.frets = made.voices[i], made.pool.records[i], made.frets
        self.record = self.voice.record[0]
        self.frame, self.out = 0, np.zeros(1)

    def play(self, events: np.ndarray) -> None:
        """Plays the next frame, with `events` at its beginning."""
        events["frame"] = self.frame
        play_frames(self.voice, self.ops, events, self.out)
        self.frame += 1

    def let_ring(self, seconds: float) -> None:
        """Plays on without events."""
        out = np.zeros(round(seconds * RATE))
        play_frames(self.voice, self.ops, np.zeros(0, EVENT), out)
        self.frame += len(out)

    def slot(self) -> np.void:
        """The slot that plays."""
        found: np.void = self.voice.slots[int(self.record["slot"])]
        return found

    def energy(self) -> float:
        """Energy (J) of both slots, without the share stored in contacts."""
        total = 0.0
        for slot in self.voice.slots:
            if slot["on"]:
                op = self.ops[int(slot["fret"])]
                total += self._of_slot(slot, op)
        return total

    def _of_slot(self, slot: np.void, op: np.void) -> float:
        total = slope = 0.0
        length, speed = float(op["length"]), float(op["speed"])
        low = min(int(length / (np.pi * speed * float(op["fine"] * op["steps"]))) // BLOCK * BLOCK, int(slot["active"]))
        while low and slot["u"]["omega"][min(low, int(op["modes"])) - 1] * float(op["fine"] * op["steps"]) > 1:
            low -= BLOCK
        for name, count in (("u", int(slot["active"])), ("v", int(slot["v_active"]))):
            w = slot[name]
            q, p = modal_row(w, "q")[:count], modal_row(w, "p")[:count]
            slow = (w["kappa"] * w["omega"])[:count] * q
            total += float(p @ p + slow @ slow) / (2 * float(op["weight"]))
            few = min(low, count)
            bent = np.arange(1, few + 1) * np.pi / length * q[:few]
            slope += float(bent @ bent)
        stretch = float(self.record["stretch"])
        if stretch:  # the tension grows by stretch times slope, up to a limit
            maximum = tension.MAXIMUM * float(op["fine"] ** 2 / op["weight"]) * speed**2 / stretch
            below = min(slope, maximum)
            total += stretch * (below**2 / 4 + maximum * (slope - below) / 2)
        return total

    def hands(self) -> tuple[bool, float, int]:
        """True if a hand is working on the string; the tuning, and the slot, which change while a hand works."""
        r = self.record
        works = r["pulling"] > 0 or r["striking"] > 0 or r["depth"] > 0 or self.voice.slots["moving"].any()
        works = works or r["slide_to"] >= 0  # works, and scrapes the windings
        works = works or any(slot["on"] and slot["thumb"]["on"] for slot in self.voice.slots)
        on = [slot for slot in self.voice.slots if slot["on"] and not slot["between"]]
        works = works or any(slot["sunk"] and self.ops[int(slot["fret"])]["draped"] for slot in on)
        return bool(works), float(r["tuned"]), int(r["slot"])


def event(kind: int, fret: int = 0, **values: float) -> np.ndarray:
    made = np.zeros(1, EVENT)
    made["kind"], made["fret"] = kind, fret
    for name, value in values.items():
        made[name] = value
    return made


def single_frames(first: int, last: int) -> np.ndarray:
    """Events that change nothing, one in each frame from `first` to before `last`: none moves together with others."""
    made = np.repeat(event(GAIN, value=1.0), last - first)
    made["frame"] = np.arange(first, last)
    return made
