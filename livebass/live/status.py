"""Status line, meters and advice of a live session. [main thread, unless marked any]"""

from __future__ import annotations

import logging
import math
from pathlib import Path

from livebass.live.control import meter_table, tuner_meters
from livebass.live.desk import FILE
from livebass.live.keyboard import TerminalKeys
from livebass.live.osc import Value
from livebass.live.presets import PresetSwitch
from livebass.live.rig import Rig
from livebass.live.synth import Gauge, Reading, strings
from livebass.live.tuner import frequency_of, tuning_text
from livebass.model.instrument import A4_HZ

LOG = logging.getLogger("livebass.live.session")
SETTLED = 1.0  # s after the start in which underruns are nobody's fault
LOW_LOAD = 0.5  # part of a block's time: with less, underruns are the system's fault ...
SEVERAL = 3  # ... and from so many on a line reports them


class Status:
    """Reads the gauge of a rig, and shows its reading."""

    def __init__(self, rig: Rig, presets: PresetSwitch, gauge: Gauge, keys: TerminalKeys | None = None) -> None:
        self.rig, self.presets, self.gauge, self.keys = rig, presets, gauge, keys
        self.reading: Reading | None = None  # the latest
        self._underruns = self._excused = 0  # in total; at low load
        self._advised = False

    def read(self) -> Reading:
        """Reads the gauge."""
        self.reading = self.gauge.read()
        return self.reading

    def frequency(self) -> float:
        """The pitch that sounds, Hz; NaN without a tuner. [any thread]"""
        synth = self.rig.output.synth
        return frequency_of(synth.recent, synth.rate) if self.rig.settings.tuner else math.nan

    def a4(self) -> float:
        """The pitch of A4 (Hz) that the bass is tuned to. [any thread]"""
        bass = self.rig.output.synth.bass
        return bass.engine.instrument.a4 if bass else A4_HZ

    def meters(self) -> dict[str, Value]:
        """All meters for the control socket, by name. [any thread]"""
        desk, notes = self.rig.desk, strings(self.rig.output.synth)
        return meter_table(self.reading) | {
            "notes": notes, "preset": self.presets.playing[0], "quality": self.presets.quality,
            "position": desk.position, "tempo": desk.tempo,
        } | tuner_meters(self.frequency(), self.a4())  # fmt: skip

    def line(self, reading: Reading) -> str:
        """The status line: level, notes, preset, load, and the keyboard's velocity and octave."""
        notes, preset = strings(self.rig.output.synth) or "-", Path(self.presets.playing[0]).stem
        parts = [reading.meter(), notes, preset, reading.load_text()]
        desk = self.rig.desk
        if self.rig.settings.tuner:
            parts.insert(0, tuning_text(self.frequency(), self.a4()))
        if desk.score:
            loop = "loop {} to {}".format(*map(clock, desk.loop)) if desk.loop else ""
            tempo = f"tempo {desk.tempo:.0%}" if desk.tempo != 1 else ""
            stands = "" if desk.rolling else "paused"
            place = f"{clock(desk.position)} of {clock(desk.length)}"
            parts.append(", ".join(part for part in (place, loop, tempo, stands) if part))
        if desk.beats:
            parts.append(f"metronome {'by the file' if desk.beats == FILE else f'{desk.beats:g}'}")
        if self.keys and self.keys.active:
            parts.append(f"velocity {self.keys.velocity}, octave {self.keys.octave}")
            parts.append(self.keys.ways)
        return "   ".join(part for part in parts if part)

    def advise(self, reading: Reading, seconds: float) -> None:
        """Logs a remedy once if underruns occur at low load."""
        new = reading.meters.underruns - self._underruns
        self._underruns += new
        if seconds > SETTLED and reading.meters.worst < LOW_LOAD:
            self._excused += new
        if self._excused >= SEVERAL and not self._advised:
            self._advised = True
            LOG.warning(
                "%d underruns while no block took half of its time: the system is late, not the bass; %s",
                self._excused, self.rig.output.advice(),
            )  # fmt: skip


def clock(seconds: float) -> str:
    """A time in a score, such as `1:05`."""
    whole = max(int(seconds), 0)
    return f"{whole // 60}:{whole % 60:02d}"
