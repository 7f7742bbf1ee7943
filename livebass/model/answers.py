"""Strings that answer each other through the neck: which modes of idle strings may answer.

A string pushes a yielding neck with the force T u'. The nut, where the open strings end, then moves at Y times that
force, each resonance of the neck weighted by its bending shape at the force: at a fret the sign may differ. The saddle
is rigid here. kernels/bass/bench.py computes the nut's motion; kernels/string/answers.py has the equations.
"""

from __future__ import annotations

import numpy as np

from livebass.arrays import Floats
from livebass.model.instrument import Instrument, speaking
from livebass.model.modes import frequencies

HIGHEST = 2000.0  # Hz, of answering modes, as far as MOST_ANSWERS and COUNTED allow
MOST_ANSWERS = 128  # of one string (kernels.records)
LOWER = 0.9  # lowers that limit while there are too many modes
COUNTED = 60  # modes computed per open string: those below the limit answer


def answering_modes(instrument: Instrument) -> tuple[int, ...]:
    """Number of modes of each open string, from its lowest, that may answer other strings; 0 if none do."""
    if instrument.player.answering == "off":
        return (0,) * len(instrument.strings)
    known = [_open_frequencies(instrument, t) for t in range(len(instrument.strings))]
    highest = HIGHEST
    while True:
        counts = tuple(int(np.searchsorted(nu, highest)) for nu in known)
        if sum(counts) - min(counts) <= MOST_ANSWERS:
            return counts
        highest *= LOWER


def _open_frequencies(instrument: Instrument, t: int) -> Floats:
    return frequencies(speaking(instrument.strings[t], instrument.necks[t], 0), COUNTED)
