"""The parameters of `play` and of the plugins, as hosts see them; the rows are in techniques.py.

The usual value of a parameter of the playing is 0, "as the bass itself has it": with all of them there a plugin plays
what `livebass render` renders. Those are sample-accurate, and the amounts that controllers move too, from 0, none, and
the knobs of effects; the rest belongs to what is around the synth.
"""

from __future__ import annotations

from livebass.kernels.player.performer import MOST_STRINGS
from livebass.live.thread.ring import AMOUNT, EFFECT, PARAMETER
from livebass.techniques import EFFECTS, FUNCTION_ROWS, LEARNABLE, PARAMETER_ROWS, Parameter

PARAMETERS = tuple(PARAMETER_ROWS.values())  # by number
NUMBERS = {symbol: PARAMETER_ROWS[symbol].number for symbol in LEARNABLE}
GROUPS = tuple(dict.fromkeys(p.group for p in PARAMETERS))
# What hosts call the outputs of a plugin with an output a string; those of strings that the bass has not are silent.
OUTPUTS = ("String 1 (lowest)", *(f"String {k}" for k in range(2, MOST_STRINGS + 1)))


def event(p: Parameter) -> tuple[int, int] | None:
    """Returns kind and number of the synth's event that sets a parameter (ring.py); None for one around the synth."""
    if p.symbol in NUMBERS:
        return PARAMETER, p.number
    if p.symbol in EFFECTS:
        return EFFECT, EFFECTS.index(p.symbol)
    return (AMOUNT, FUNCTION_ROWS[p.symbol].number) if p.symbol in FUNCTION_ROWS else None
