"""Functions of MIDI keys and controllers besides playing notes: the key maps of MODO BASS, and velocity curves.

A bass carries its map, `Player.keys`: files, live playing, plugins and page all follow it. Custom maps come from TOML
files (preset/keymap.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from livebass.rows.parts import PlayerNumbers
from livebass.rows.techniques import FUNCTION_ROWS, HAND_AT, LEARNABLE, LEARNED, ON_STRING, TECHNIQUE_ROWS, Technique
from livebass.rows.units import note_name

KEYS = 128
MIDDLE = 60  # the key that one half of the DAWs call C4, the other half C3
COUNTING = f"{note_name(MIDDLE)} is key {MIDDLE}; DAWs that call it C3 show names an octave lower: E1 as E0"
# A controller of the pluck position besides the map's, unless a preset sets another
PLACE = PlayerNumbers.position_controller
CURVES = {"linear": 1.0, "soft": 0.6, "hard": 1.6}  # exponents
Curve = str | float | tuple[tuple[float, float], ...]  # name, exponent, or points: velocity played, velocity meant


@dataclass(frozen=True)
class KeyMap:
    """Functions of keys and controllers."""

    name: str
    keys: tuple[tuple[int, str, int], ...]  # key, a technique's symbol, and its value: a pitch class, or a fret
    controllers: tuple[tuple[int, str], ...]  # controller, and a function's symbol
    over_notes: bool = False  # keys switch even if the bass has their notes

    def functions(self, place: int = PLACE) -> dict[int, str]:
        """The symbol of each controller's function, if it has one; `place` moves the pluck position, too."""
        found = {LEARNED + number: symbol for number, symbol in enumerate(LEARNABLE)} | {place: "place"}
        found |= dict(self.controllers)
        return found if place == PLACE else found | {place: "place"}  # a preset sets it


def _value(row: Technique, key: int) -> int:
    """The value of the technique that `key` switches in the shipped maps."""
    if row.number == ON_STRING:
        return key % 12
    return 1 + key - row.modo_12[0] if row.number == HAND_AT else 0


def _made(name: str, over_notes: bool, keys: Callable[[Technique], tuple[int, ...]]) -> KeyMap:
    """A map of the techniques' own `keys` and the functions' controllers."""
    switches = [(key, row.symbol, _value(row, key)) for row in TECHNIQUE_ROWS.values() for key in keys(row)]
    controllers = [(number, row.symbol) for row in FUNCTION_ROWS.values() for number in row.controllers]
    return KeyMap(name, tuple(sorted(switches)), tuple(sorted(controllers)), over_notes)


MODO = _made("modo", False, lambda row: row.modo)
MODO_12 = _made("modo-12", True, lambda row: row.modo_12)  # an octave higher, and more
MAPS = {keys.name: keys for keys in (MODO, MODO_12)}


def named_keys(keys: Sequence[int]) -> str:
    """Names keys, by `COUNTING`, with their numbers: "D#0 (15)", "G#0 F8 (20 113)"; adjacent keys by their ends."""
    if not keys:
        return ""
    between = " "
    if len(keys) > 2 and list(keys) == list(range(keys[0], keys[-1] + 1)):
        keys, between = (keys[0], keys[-1]), " to "
    return f"{between.join(map(note_name, keys))} ({between.join(map(str, keys))})"


def velocity_parts(curve: Curve) -> list[float]:
    """Force of each velocity, 0 to 127, as a fraction of the way from the softest note (0) to the hardest (1).

    Straight lines join the points, and run level to velocities 1 and 127.
    """
    if isinstance(curve, tuple):
        points = [(1.0, curve[0][1]), *curve, (127.0, curve[-1][1])]
        return [_between(points, velocity) for velocity in range(KEYS)]
    exponent = CURVES[curve] if isinstance(curve, str) else curve
    parts = [max(velocity - 1, 0) / 126.0 for velocity in range(KEYS)]
    return parts if exponent == 1.0 else [part**exponent for part in parts]


def _between(points: list[tuple[float, float]], velocity: int) -> float:
    """The fraction for `velocity` on the line through `points`."""
    (x, y), (x_next, y_next) = next((a, b) for a, b in pairwise(points) if velocity <= b[0] or b is points[-1])
    where = (velocity - x) / (x_next - x) if x_next > x else 1.0
    return min(max((y + max(where, 0.0) * (y_next - y) - 1) / 126.0, 0.0), 1.0)
