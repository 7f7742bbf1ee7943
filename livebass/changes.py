"""Another preset or quality while it sounds: prepared in a thread beside, put on at a block's edge. [main thread]"""

from __future__ import annotations

import ctypes
import os
import sys
import threading
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress

from livebass.preset import load_preset, preset_names
from livebass.quality import QUALITIES, Quality
from livebass.stage import LiveBass, Stage

NICENESS = 10  # of the thread that prepares: what sounds comes first


class Changes:
    """What is wished for and what plays. The last wish counts; those that it overtook are never prepared."""

    def __init__(self, stage: Stage, preset: str, quality: Quality) -> None:
        """`preset`, a name or path, and `quality` are what is on the stage already."""
        self.stage = stage
        self.qualities = {**QUALITIES, quality.name: quality}
        self.playing = self.wanted = (preset, quality.name)
        self._thread = ThreadPoolExecutor(1, "changes", _step_back)
        self._coming: tuple[tuple[str, str], Future[LiveBass]] | None = None
        self._leaving = False  # the bass before
        self._programs = int(stage.record["program_count"][0])

    def next_preset(self) -> None:
        names = preset_names()
        known = self.wanted[0] in names
        self.wanted = names[(names.index(self.wanted[0]) + 1) % len(names) if known else 0], self.wanted[1]

    def next_quality(self) -> None:
        names = list(self.qualities)
        self.wanted = self.wanted[0], names[(names.index(self.wanted[1]) + 1) % len(names)]

    def turn(self) -> str | None:
        """Looks for program changes, starts what is to be prepared, puts on what is ready; a line for people, or None.

        Returns at once. What a preset's file has wrong is such a line too, and the bass before plays on.
        """
        self._hear()
        self.stage.clear_away()
        fading = any(self.stage.record[name][0] for name in ("next_bass", "old_bass", "free_bass"))
        if self._leaving and not fading:
            self._leaving = False
            self._thread.submit(give_back)
        if self._coming is None:
            if self.wanted != self.playing:
                preset, quality = self.wanted
                self._coming = self.wanted, self._thread.submit(
                    prepared, preset, self.qualities[quality], self.stage.rate
                )
            return None
        wanted, future = self._coming
        if not future.done():
            return None
        if wanted == self.wanted and fading:
            return None
        self._coming = None
        if wanted != self.wanted:
            return None
        try:
            bass = future.result()
        except (ValueError, OSError) as error:
            self.wanted = self.playing
            return f"{wanted[0]}: {error}"
        before, self.playing = self.stage.bass, wanted
        if before is not None:
            take_over(before, bass)
        self.stage.put_on(bass)
        self._leaving = True
        return f"preset {wanted[0]}, quality {wanted[1]}"

    def _hear(self) -> None:
        """A program change means the preset of that number, in the order of `livebass presets list`."""
        count = int(self.stage.record["program_count"][0])
        if count != self._programs:
            self._programs = count
            names, number = preset_names(), int(self.stage.record["program"][0])
            self.wanted = names[((number >> 8) * 128 + (number & 0x7F)) % len(names)], self.wanted[1]

    def close(self) -> None:
        self._thread.shutdown(wait=False, cancel_futures=True)


def prepared(preset: str, quality: Quality, rate: int) -> LiveBass:
    """A bass for the stage. Raises PresetError and ValueError. [any thread]"""
    bass = LiveBass(load_preset(preset), quality, rate)
    give_back()
    return bass


def give_back() -> None:
    """What was allocated on the way goes back to the system, where the C library would keep it. [any thread]"""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


def take_over(old: LiveBass, new: LiveBass) -> None:
    """Volume, pedal, wheel and the other controllers of `old` hold for `new`, which has not been put on."""
    p, q = old.engine.performer, new.engine.performer
    for name in ("volume", "expression", "wheel", "pedal", "parameter"):
        q[name] = p[name]
    if p["range"][0] != old.engine.instrument.player.bend_range:
        q["range"] = p["range"]
    if p["position"][0] != p["usual_position"][0]:
        part = (p["position"] - p["nearest"]) / (p["farthest"] - p["nearest"])
        q["position"] = q["nearest"] + (q["farthest"] - q["nearest"]) * part
    for v in new.engine.voices:
        v.record["gain"] = v.record["gain_wanted"] = (q["volume"] * q["expression"]) ** 2
        v.record["bend"] = v.record["tuned"] = 2.0 ** (q["wheel"] * q["range"] / 12.0)


def _step_back() -> None:
    if sys.platform == "linux":  # where a thread has a niceness of its own
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)
