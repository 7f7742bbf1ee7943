"""One interface to the plugins of all formats: hosts of CLAP, VST3 and LV2 that take MIDI and parameter values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from ctypes import c_uint8
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from livebass.live.parameters import PARAMETERS
from livebass.plugin import clap, lv2, vst3
from livebass.rows.arrays import Floats
from livebass.score.score import Score
from support import clap as of_clap
from support import lv2 as of_lv2
from support import vst3 as of_vst3
from support.plugins import RATE, write_bundle
from support.scores import blocks


class Expression(NamedTuple):
    """Shapes a note of a channel and key: TUNING, in semitones, VIBRATO or PLACE, 0 to 1."""

    kind: int
    channel: int
    key: int
    amount: float


TUNING, VIBRATO, PLACE = range(3)
Event = tuple[int, bytes | Expression]  # (frame, MIDI or an expression)
Events = Sequence[Event] | Score  # in order
Points = Sequence[tuple[int, str, float]]  # (frame, symbol of a parameter, value) in order
NUMBERS = {p.symbol: p.number for p in PARAMETERS}
NOTE_OFF, NOTE_ON, CONTROLLER, PRESSURE, BEND = 0x80, 0x90, 0xB0, 0xD0, 0xE0


class Host:
    """A plugin with one output, or with one per string if `apart`; its first bass is chosen."""

    module: Any
    plugin: Any
    folder = "livebass"

    def __init__(self, place: Path, apart: bool = False, rate: int = RATE, offline: bool = False) -> None:
        self.apart = apart

    @classmethod
    def write(cls, folder: Path) -> Path:
        """Writes the usual bundle into its own folder below `folder`."""
        return write_bundle(cls.module, folder / cls.folder)

    def block(self, frames: int, events: list[Event], points: list[tuple[int, str, float]]) -> Floats:
        """Plays a block; returns (outputs, frames)."""
        raise NotImplementedError

    def play(self, events: Events, frames: int, sizes: Iterable[int] = (512,), points: Points = ()) -> Floats:
        """Plays in blocks of `sizes`, in turn; returns (frames,), or (outputs, frames) for several outputs."""
        if isinstance(events, Score):
            events = [(int(f), m.tobytes()) for f, m in zip(events.frames, events.messages, strict=True)]
        out = []
        for begin, size in blocks(frames, sizes):
            now = [(f - begin, m) for f, m in events if begin <= f < begin + size]
            values = [(f - begin, s, x) for f, s, x in points if begin <= f < begin + size]
            out.append(self.block(size, now, values))
        whole = np.concatenate(out, axis=-1)[:, :frames]
        return whole if self.apart else whole[0]

    def switch(self, on: bool) -> None:
        """Switches the plugin on or off."""
        raise NotImplementedError

    def renew(self) -> None:
        """Switches the plugin off and on again, which resets it."""
        self.switch(False)
        self.switch(True)

    def offline(self, on: bool) -> None:
        """Begins or ends rendering offline."""
        raise NotImplementedError

    def choose(self, bass: int) -> None:
        """Starts again with another bass."""
        raise NotImplementedError

    def save(self) -> Any:
        """Its state."""
        return self.plugin.save()

    def load(self, state: Any) -> bool:
        """Loads a state; returns whether the plugin took it."""
        return bool(self.plugin.load(state))

    def work(self) -> None:
        """Does the work that the plugin asks of the host."""

    def lines(self, errors: str) -> list[str]:
        """The plugin's messages so far, in a log or on the standard error stream."""
        return [line for line in errors.splitlines() if "livebass" in line]

    def close(self) -> None:
        self.plugin.close()


class Logging(Host):
    """A host that does the work its plugin asks for and logs the plugin's messages."""

    def work(self) -> None:
        self.plugin.work()

    def lines(self, errors: str) -> list[str]:
        return self.plugin.logged


class Clap(Logging):
    """A host that sends notes in CLAP's own form and the rest as MIDI."""

    module = clap
    native = True

    def __init__(self, place: Path, apart: bool = False, rate: int = RATE, offline: bool = False) -> None:
        super().__init__(place, apart, rate, offline)
        self.plugin = of_clap.Plugin(place, rate, of_clap.STRINGS if apart else of_clap.MONO, active=False)
        self.plugin.offline(offline)
        self.plugin.activate()

    def _event(self, message: bytes | Expression) -> Any:
        if isinstance(message, Expression):
            kind = (of_clap.TUNING, of_clap.EXPRESSION_VIBRATO, of_clap.BRIGHTNESS)[message.kind]
            return of_clap.expression(kind, message.amount, message.key, channel=message.channel)
        kind, channel = message[0] & 0xF0, message[0] & 0x0F
        if not self.native or kind not in (NOTE_ON, NOTE_OFF):
            return of_clap.midi(message)
        if kind == NOTE_ON and message[2]:
            return of_clap.note_on(message[1], message[2] / 127, channel=channel)
        return of_clap.note_off(message[1], channel=channel)

    def block(self, frames: int, events: list[Event], points: list[tuple[int, str, float]]) -> Floats:
        made = [(frame, of_clap.value(NUMBERS[symbol], x)) for frame, symbol, x in points]
        made += [(frame, self._event(message)) for frame, message in events]
        for frame, event in made:
            event.time = frame
        out = self.plugin.block(frames, [event for _, event in sorted(made, key=lambda one: one[0])])
        return out.reshape(-1, frames)

    def switch(self, on: bool) -> None:
        (self.plugin.activate if on else self.plugin.deactivate)()

    def offline(self, on: bool) -> None:
        self.plugin.offline(on)

    def choose(self, bass: int) -> None:
        self.plugin.set(NUMBERS["bass"], bass)
        self.renew()


class ClapOfMidi(Clap):
    """A host that sends only MIDI."""

    native = False


class Lv2(Logging):
    module, folder = lv2, "livebass.lv2"

    def __init__(self, place: Path, apart: bool = False, rate: int = RATE, offline: bool = False) -> None:
        super().__init__(place, apart, rate, offline)
        self.plugin = of_lv2.Plugin(place, rate, index=int(apart), outputs=8 if apart else 1)
        self.plugin.controls["freewheeling"].value = float(offline)

    def block(self, frames: int, events: list[Event], points: list[tuple[int, str, float]]) -> Floats:
        for frame, symbol, x in points:
            assert frame == 0, "its ports have one value a block"
            self.plugin.controls[symbol].value = x
        return self.plugin.block(frames, [(f, m) for f, m in events if isinstance(m, bytes)]).reshape(-1, frames)

    def switch(self, on: bool) -> None:
        (self.plugin.plugin.activate if on else self.plugin.plugin.deactivate)(self.plugin.handle)

    def offline(self, on: bool) -> None:
        self.plugin.controls["freewheeling"].value = float(on)

    def load(self, state: Any) -> bool:
        return bool(self.plugin.restore(state) == 0)

    def choose(self, bass: int) -> None:
        self.plugin.controls["bass"].value = float(bass)
        self.plugin.block(64)
        self.plugin.work()
        self.renew()


class Vst3(Host):
    """A host that numbers its notes and sends all other MIDI as parameter points."""

    module, folder = vst3, "livebass.vst3"

    def __init__(self, place: Path, apart: bool = False, rate: int = RATE, offline: bool = False) -> None:
        super().__init__(place, apart, rate, offline)
        mode = of_vst3.OFFLINE if offline else of_vst3.REAL_TIME
        self.plugin = of_vst3.Plugin(place, of_vst3.STRINGS if apart else of_vst3.MONO, mode, rate=rate)
        self.sent = 0
        self.ids: dict[tuple[int, int], int] = {}
        self.mapped: dict[tuple[int, int], int] = {}
        self.basses = len(self.plugin.programs())

    def _normal(self, symbol: str, x: float) -> float:
        p = PARAMETERS[NUMBERS[symbol]]
        maximum = max(self.basses - 1, 1) if symbol == "bass" else p.maximum
        return (x - p.minimum) / (maximum - p.minimum)

    def _point(self, frame: int, channel: int, controller: int, x: float) -> tuple[int, int, float]:
        if (channel, controller) not in self.mapped:
            self.mapped[channel, controller] = self.plugin.mapped(channel, controller)
        return self.mapped[channel, controller], frame, x

    def block(self, frames: int, events: list[Event], points: list[tuple[int, str, float]]) -> Floats:
        notes, moved = [], [(NUMBERS[symbol], frame, self._normal(symbol, x)) for frame, symbol, x in points]
        for frame, message in events:
            if isinstance(message, Expression):
                amount = message.amount / 240 + 0.5 if message.kind == TUNING else message.amount
                kind = (of_vst3.TUNING, of_vst3.EXPRESSION_VIBRATO, of_vst3.BRIGHTNESS)[message.kind]
                notes.append(of_vst3.expression(kind, amount, self.ids[message.channel, message.key], frame))
                continue
            kind, channel, first = message[0] & 0xF0, message[0] & 0x0F, message[1]
            if kind == NOTE_ON and message[2]:
                self.sent += 1
                self.ids[channel, first] = self.sent
                notes.append(of_vst3.note_on(first, message[2] / 127, self.sent, frame, channel))
            elif kind in (NOTE_ON, NOTE_OFF):
                notes.append(of_vst3.note_off(first, self.ids.get((channel, first), -1), frame, channel))
            elif kind == BEND:
                moved.append(self._point(frame, channel, 129, (first + 128 * message[2]) / 16383))
            elif kind == PRESSURE:
                moved.append(self._point(frame, channel, 128, first / 127))
            elif kind == CONTROLLER:
                moved.append(self._point(frame, channel, first, message[2] / 127))
        return self.plugin.block(frames, notes, moved)[:, 0]

    def switch(self, on: bool) -> None:
        assert self.plugin.component.call(11, c_uint8(on)) == 0

    def offline(self, on: bool) -> None:
        self.plugin.mode = of_vst3.OFFLINE if on else of_vst3.REAL_TIME

    def choose(self, bass: int) -> None:
        self.plugin.set(NUMBERS["bass"], self._normal("bass", bass))
        self.renew()


HOSTS: dict[str, type[Host]] = {"clap": Clap, "clap-midi": ClapOfMidi, "vst3": Vst3, "lv2": Lv2}
FORMATS = [name for name in HOSTS if name != "clap-midi"]
