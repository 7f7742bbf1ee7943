"""The control socket's table: every parameter, the score, the metronome, notes, and every meter, by name."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from livebass.kernels.score.lines import LONGEST
from livebass.live.desk import BEATS, TEMPOS, Desk
from livebass.live.osc import Control, Value
from livebass.live.parameters import PARAMETERS
from livebass.live.synth import COUNTS, Reading, Synth, decibels
from livebass.live.tuner import tuning
from livebass.model.instrument import A4_HZ
from livebass.preset.load import preset_names
from livebass.rows.bounds import between
from livebass.rows.techniques import PARAMETER_ROWS, Parameter, event

MAX_COUNT = (1 << 31) - 1  # OSC integers are 32-bit


class Presets(Protocol):
    """Switches presets and qualities."""

    @property
    def playing(self) -> tuple[str, str]: ...

    @property
    def quality(self) -> str: ...

    def choose(self, preset: str | None = None, quality: str | None = None) -> None: ...


def control_table(
    synth: Callable[[], Synth],
    desk: Desk,
    presets: Presets,
    roll: Callable[[bool], None],
    seek: Callable[[float], None],
) -> dict[str, Control]:
    """The controls of a session by name; `synth` returns the one that plays. [any thread] may use them."""

    def moved(p: Parameter, kind: int, number: int) -> Control:
        def write(value: Value) -> None:
            synth().set_value(kind, number, parameter_value(p, value))

        return Control(write, lambda: synth().value(kind, number))

    def relief(value: Value) -> None:
        synth().record["adaptive"] = int(switch(value))

    def running_ahead(value: Value) -> None:
        synth().runs_ahead = switch(value)

    def cores(value: Value) -> None:
        synth().ask_for_cores(round(parameter_value(PARAMETER_ROWS["cores"], value)))

    def bass(value: Value) -> None:
        presets.choose(preset=value if isinstance(value, str) else at(preset_names(), value))

    def quality(value: Value) -> None:
        points = list(PARAMETER_ROWS["quality"].points)
        presets.choose(quality=value if isinstance(value, str) else at(points, value))

    def tempo(value: Value) -> None:
        desk.tempo = check_number(value, *TEMPOS)

    def loop(begin: Value, end: Value) -> None:
        if desk.follows_transport:
            raise ValueError("JACK's transport controls this")
        part = check_number(begin, 0.0, LONGEST), check_number(end, 0.0, LONGEST)
        desk.loop = part if part[1] > part[0] else None

    def metronome(value: Value) -> None:
        beats = check_number(value, *BEATS) if value else 0.0
        desk.click(beats, synth().rate, synth().frame)

    def note(key: Value, velocity: Value) -> None:
        key, velocity = int(check_number(key, 0, 127)), int(check_number(velocity, 0, 127))
        synth().send(0x90 if velocity else 0x80, key, velocity)

    table = {p.symbol: moved(p, *found) for p in PARAMETERS if (found := event(p))}
    table |= {
        "bass": Control(bass, lambda: presets.playing[0]),
        "quality": Control(quality, lambda: presets.quality),
        "running_ahead": Control(running_ahead, lambda: int(synth().runs_ahead)),
        "relief": Control(relief, lambda: int(synth().record["adaptive"][0])),
        "cores": Control(cores, lambda: synth().cores),
        "note": Control(note),
        "panic": Control(lambda *_: synth().panic()),
        "metronome": Control(metronome, lambda: max(desk.beats, 0.0)),
    }
    if desk.score:
        table |= {
            "rolling": Control(lambda value: roll(switch(value)), lambda: int(desk.rolling)),
            "position": Control(lambda value: seek(check_number(value, 0.0, desk.length)), lambda: desk.position),
            "tempo": Control(tempo, lambda: desk.tempo),
            "loop": Control(loop, lambda: desk.loop[0] if desk.loop else -1.0),
        }
    return table


def check_number(value: Value, minimum: float, maximum: float) -> float:
    """The number `value`. Raises ValueError for anything else and outside the limits."""
    if not isinstance(value, int | float) or not minimum <= value <= maximum:
        raise ValueError(f"must be a number {between(minimum, maximum)}, not {value!r}")
    return float(value)


def parameter_value(p: Parameter, value: Value) -> float:
    """A value for the parameter `p`, from a number within its limits or the name of a point."""
    if isinstance(value, str) and value in p.points:
        return float(p.points.index(value))
    number = check_number(value, p.minimum, p.maximum)
    return float(round(number)) if p.whole else number


def switch(value: Value) -> bool:
    """True or False, from 1 or 0."""
    return check_number(value, 0, 1) >= 0.5


def at(names: list[str], value: Value) -> str:
    """The name at index `value`, from 0."""
    return names[int(check_number(value, 0, len(names) - 1))]


def meter_table(reading: Reading | None) -> dict[str, Value]:
    """The meters of a reading, by name; loads are parts of a block's time, the peak is in dB, counts have 31 bits."""
    if reading is None:
        return {}
    m = reading.meters
    counts = {name: getattr(m, name) & MAX_COUNT for name in (*COUNTS, "lost")}
    return {"load": reading.median, "worst": m.worst, "peak": decibels(m.peak)} | counts


def tuner_meters(frequency: float, a4: float = A4_HZ) -> dict[str, Value]:
    """The pitch that sounds (Hz, NaN: none), its note if A4 is at `a4` Hz, and its deviation in cents.

    0, - and 0 if there is none.
    """
    note, cents = tuning(frequency, a4) or ("-", 0.0)
    return {"frequency": 0.0 if math.isnan(frequency) else frequency, "note": note, "cents": cents}
