"""Strings that answer each other through the neck: which modes of idle strings may answer, and what couples them.

A string that ends where the neck yields pushes it with the force T u'. The nut, where the open strings end, then moves
at Y times that force, with a resonance of the neck counted by its bending shape at the place of the force: at a fret it
may have the other sign. The saddle is rigid here. kernels/bass/bench.py works out how it moves, and
kernels/string/answers.py has the equations of motion.
"""

from __future__ import annotations

import numpy as np

from livebass.arrays import Floats
from livebass.model.instrument import Instrument, speaking
from livebass.model.modes import frequencies

HIGHEST = 700.0  # Hz, of modes that answer: above, answers stay 60 dB below the note
MOST_ANSWERS = 128  # of one string (kernels.records)
LOWER = 0.9  # factor of that limit while there are too many modes
COUNTED = 60  # modes of an open string, of which those below the limit answer


def answering_modes(instrument: Instrument) -> tuple[int, ...]:
    """How many modes of each open string, from its lowest, may answer other strings; none where none answers."""
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
