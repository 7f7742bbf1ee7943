"""The parameters of `play` and the plugins, as hosts see them; the rows are in techniques.py.

Playing parameters default to 0, which leaves the bass as it is: with all at 0 a plugin plays exactly as `livebass
render`. They are sample-accurate, as are the amounts that controllers move, from 0, none, and the knobs of effects.
The other parameters belong to the synth's surroundings.
"""

from __future__ import annotations

from livebass.kernels.player.performer import MOST_STRINGS
from livebass.live.thread.ring import AMOUNT, EFFECT, PARAMETER, SWITCH
from livebass.techniques import EFFECTS, FUNCTION_ROWS, LEARNABLE, PARAMETER_ROWS, TECHNIQUE_ROWS, Parameter

PARAMETERS = tuple(PARAMETER_ROWS.values())  # by number
NUMBERS = {symbol: PARAMETER_ROWS[symbol].number for symbol in LEARNABLE}
GROUPS = tuple(dict.fromkeys(p.group for p in PARAMETERS))
# Port names of plugins with an output per string; ports of strings that the bass lacks are silent.
OUTPUTS = ("String 1 (lowest)", *(f"String {k}" for k in range(2, MOST_STRINGS + 1)))


def event(p: Parameter) -> tuple[int, int] | None:
    """Returns kind and number of the synth's event that sets a parameter (ring.py); None for one outside the synth."""
    if p.symbol in NUMBERS:
        return PARAMETER, p.number
    if p.symbol in EFFECTS:
        return EFFECT, EFFECTS.index(p.symbol)
    if p.symbol in TECHNIQUE_ROWS and p.points:
        return SWITCH, TECHNIQUE_ROWS[p.symbol].number
    return (AMOUNT, FUNCTION_ROWS[p.symbol].number) if p.symbol in FUNCTION_ROWS else None
