"""Switches the playing bass to another preset or quality, prepared in its own thread. [main thread]

It begins at the start of a block, while the previous bass rings out.
"""

from __future__ import annotations

import ctypes
import logging
import os
import sys
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress

from livebass.live.best_quality import prepare_bass
from livebass.live.synth import LiveBass, Synth
from livebass.model.instrument import Instrument
from livebass.model.quality import AUTO, QUALITIES, Quality
from livebass.preset.load import load_preset, preset_names
from livebass.preset.programs import PROGRAMS

LOG = logging.getLogger("livebass.live.session")
NONE: Mapping[int, str] = {}
NICENESS = 10  # of the preparing thread: sound comes first
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # parameters of glibc's mallopt ...
LARGE = 1 << 20  # ... in bytes: with less, preparing a bass takes up to 40 % longer


class PresetSwitch:
    """Switches preset and quality while the synth plays; requests overtaken by newer ones are never prepared."""

    def __init__(
        self, synth: Synth, preset: str, quality: Quality | None, load: Callable[[str], Instrument] = load_preset,
        programs: Mapping[int, str] = NONE,
    ) -> None:  # fmt: skip
        """`preset`, a name or path, and `quality` are those of the playing bass; `load` loads the next ones.

        A quality of None is the best for this machine. `programs`, from 0, choose presets, and override General MIDI's.
        """
        self.synth, self.load = synth, load
        self.programs = {number - 1: name for number, name in PROGRAMS.items()} | dict(programs)
        self.qualities: dict[str, Quality | None] = {AUTO: None, **QUALITIES}
        if quality is not None:
            self.qualities[quality.name] = quality
        self.playing = self.wanted = (preset, quality.name if quality is not None else AUTO)
        self._thread = ThreadPoolExecutor(1, "presets", _step_back)
        self._coming: tuple[tuple[str, str], Future[LiveBass]] | None = None
        self._ringing = False  # the previous bass
        self._programs = synth.program[0]
        self._unknown: set[int] = set()  # programs already reported as choosing nothing

    @property
    def quality(self) -> str:
        """The name of the playing quality. [any thread]"""
        bass = self.synth.bass
        return bass.engine.quality.name if bass else self.playing[1]

    def next_preset(self) -> None:
        names = preset_names()
        known = self.wanted[0] in names
        self.wanted = names[(names.index(self.wanted[0]) + 1) % len(names) if known else 0], self.wanted[1]

    def choose(self, preset: str | None = None, quality: str | None = None) -> None:
        """Requests a preset or a quality by name. Raises ValueError for an unknown one. [any thread]"""
        if preset is not None and preset not in preset_names():
            raise ValueError(f"preset {preset!r}: there is {', '.join(preset_names())}")
        if quality is not None and quality not in self.qualities:
            raise ValueError(f"quality {quality!r}: there is {', '.join(self.qualities)}")
        self.wanted = preset or self.wanted[0], quality or self.wanted[1]

    def next_quality(self) -> None:
        names = list(self.qualities)
        self.wanted = self.wanted[0], names[(names.index(self.wanted[1]) + 1) % len(names)]

    def turn(self) -> str | None:
        """Answers program changes, starts preparing, switches to a prepared bass; returns a line to show, or None.

        Returns at once. An error in a preset file is such a line too, and the previous bass plays on.
        """
        self._answer_program_changes()
        self.synth.release_faded()
        if self._ringing and not self.synth.ringing:
            self._ringing = False
            self._thread.submit(return_freed_memory)
        if self._coming is None:
            if self.wanted != self.playing:
                preset, quality = self.wanted
                self._coming = (
                    self.wanted,
                    self._thread.submit(_load_bass, preset, self.qualities[quality], self.synth.rate, self.load),
                )
            return None
        wanted, future = self._coming
        if not future.done():
            return None
        if wanted == self.wanted and self.synth.switching:
            return None
        self._coming = None
        if wanted != self.wanted:
            return None
        try:
            bass = future.result()
            if bass.engine.rate != self.synth.rate:
                return None  # the rate has changed meanwhile: the next turn prepares it again
        except (ValueError, OSError) as error:
            self.wanted = self.playing
            return f"{wanted[0]}: {error}"
        self.playing = wanted
        self.synth.switch_to(bass)
        self._ringing = True
        return f"preset {wanted[0]}, quality {bass.engine.quality.name}"

    def _answer_program_changes(self) -> None:
        """Chooses the preset of a program change, by default General MIDI's; reports each unknown program once."""
        count, number = self.synth.program
        if count != self._programs:
            self._programs = count
            name = self.programs.get(number)
            if name is not None:
                self.wanted = name, self.wanted[1]
            elif number not in self._unknown:
                self._unknown.add(number)
                LOG.info("program %d chooses no bass: %d to %d do", number + 1, min(PROGRAMS), max(PROGRAMS))

    def prepare(self, instrument: Instrument, rate: int) -> Future[LiveBass]:
        """Queues a bass for preparation in the playing quality."""
        return self._thread.submit(prepare_bass, instrument, self.qualities[self.playing[1]], rate)

    def close(self) -> None:
        self._thread.shutdown(wait=False, cancel_futures=True)


def _load_bass(preset: str, quality: Quality | None, rate: int, load: Callable[[str], Instrument]) -> LiveBass:
    """Loads a preset for a synth. Raises PresetError and ValueError. [any thread]"""
    bass = prepare_bass(load(preset), quality, rate)
    return_freed_memory()
    return bass


def return_freed_memory() -> None:
    """Returns freed memory to the system, and from now on large blocks as soon as they are freed. [any thread]

    By default glibc raises its thresholds whenever a larger block is freed, and then keeps tens of MB of replaced
    basses. The settings hold for the whole process. Other C libraries are left alone.
    """
    with suppress(AttributeError, OSError, TypeError):
        library = ctypes.CDLL(None)
        for parameter in (M_TRIM_THRESHOLD, M_MMAP_THRESHOLD):
            library.mallopt(parameter, LARGE)
        library.malloc_trim(0)


def _step_back() -> None:
    """Lowers the priority of this thread, where threads have their own."""
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)
