"""The parameters of `play` and the plugins, as hosts see them; the rows are in techniques.py.

Playing parameters default to 0, which leaves the bass as it is: with all at 0 a plugin plays exactly as `livebass
render`. They are sample-accurate, as are the amounts that controllers move, from 0, none, and the knobs of effects.
The other parameters belong to the synth's surroundings.
"""

from __future__ import annotations

from livebass.kernels.player.performer import MAX_STRINGS
from livebass.rows.techniques import LEARNABLE, PARAMETER_ROWS

PARAMETERS = tuple(PARAMETER_ROWS.values())  # by number
NUMBERS = {symbol: PARAMETER_ROWS[symbol].number for symbol in LEARNABLE}
GROUPS = tuple(dict.fromkeys(p.group for p in PARAMETERS))
# Port names of plugins with an output per string; ports of strings that the bass lacks are silent.
OUTPUTS = ("String 1 (lowest)", *(f"String {k}" for k in range(2, MAX_STRINGS + 1)))
