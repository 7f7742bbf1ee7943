"""The parameters of `play` and of the plugins: one table, ids for ever, from which plugins and the page take them, too.

The usual value of a parameter of the playing is 0, "as the bass itself has it": with all of them there a plugin plays
what `livebass render` renders. Those are sample-accurate, and the amounts that controllers move too, from 0, none; the
rest belongs to what is around the synth.
"""

from __future__ import annotations

from dataclasses import dataclass

from livebass.kernels.player.performer import MOST_STRINGS
from livebass.live.thread.ring import AMOUNT, PARAMETER
from livebass.techniques import CC_PALM, CC_VIBRATO, LEAST, MOST
from livebass.techniques import PARAMETERS as PLAYING

MOST_BASSES = 128  # that a plugin offers: the last value of `bass` is one less


# What hosts call the outputs of a plugin with an output a string; those of strings that the bass has not are silent.
OUTPUTS = ("String 1 (lowest)", *(f"String {k}" for k in range(2, MOST_STRINGS + 1)))


@dataclass(frozen=True)
class Parameter:
    """A parameter. Its place in PARAMETERS is its id."""

    symbol: str
    name: str
    unit: str  # "" or dB, semitones
    least: float
    most: float
    usual: float
    whole: bool  # only whole numbers
    points: tuple[str, ...] = ()  # names of the values 0, 1 ...
    event: tuple[int, int] | None = None  # kind and number of the synth's event that sets it (ring.py)

    @property
    def group(self) -> str:
        """Names the group under which hosts show it."""
        return next(group for group, symbols in GROUPS.items() if self.symbol in symbols)


def _playing(number: int, symbol: str, name: str, unit: str = "", points: tuple[str, ...] = ()) -> Parameter:
    """A parameter of the playing, whose limits the kernels hold."""
    whole = bool(points) or unit == "semitones"
    return Parameter(symbol, name, unit, LEAST[number], MOST[number], 0.0, whole, points, (PARAMETER, number))


SWITCH = ("off", "on")
GROUPS = {
    "Sound": ("gain", "tone", "bass"),
    "Playing": (
        "pluck_position", "dynamics", "technique", "hand_damping", "unevenness", "bend_range", "palm_mute", "vibrato",
    ),
    "Processor": ("quality", "running_ahead", "relief"),
}  # fmt: skip
PARAMETERS = (
    _playing(0, "gain", "Gain", "dB"),  # the least is silence
    _playing(1, "tone", "Tone"),  # -1 the tone pot closed, 1 open
    _playing(2, "pluck_position", "Pluck position"),  # -1 nearest to the bridge, 1 farthest from it
    _playing(3, "dynamics", "Dynamics", "dB"),  # of every note's force
    _playing(
        4, "technique", "Technique", "", ("as the bass has it", "plucked", "thumb on two strings", "thumb on all")
    ),
    _playing(5, "hand_damping", "Hand damping"),  # a decade of its rate up or down
    _playing(6, "unevenness", "Unevenness"),  # added to the player's
    _playing(7, "bend_range", "Bend range", "semitones"),  # 0: as the bass has it
    Parameter("bass", "Bass", "", 0, MOST_BASSES - 1, 0, True),  # in the order of the shelf
    Parameter("quality", "Quality", "", 0, 1, 0, True, ("live", "studio")),
    Parameter("running_ahead", "Running ahead", "", 0, 1, 0, True, SWITCH),
    Parameter("relief", "Relief under overload", "", 0, 1, 1, True, SWITCH),  # never offline
    Parameter("palm_mute", "Palm mute", "", 0, 1, 0, False, event=(AMOUNT, CC_PALM)),  # as controller 9
    Parameter("vibrato", "Vibrato", "", 0, 1, 0, False, event=(AMOUNT, CC_VIBRATO)),  # as controller 1
)
NUMBERS = {p.symbol: number for number, p in enumerate(PARAMETERS[:PLAYING])}  # of those that controllers learn
