"""Strings that answer each other through the neck: which modes of idle strings may answer.

A string pushes a yielding neck with the force T u'. The nut, where the open strings end, then moves at Y times that
force, each resonance of the neck weighted by its bending shape at the force: at a fret the sign may differ. The saddle
is rigid here. kernels/bass/bench.py computes the nut's motion; kernels/string/answers.py has the equations.
"""

from __future__ import annotations

from livebass.model.instrument import Instrument

HIGHEST = 2000.0  # Hz, of answering modes, as far as MAX_ANSWERS and COUNTED allow
MAX_ANSWERS = 256  # lines of one string: modes along one axis or both (kernels/string/records.py)
LOWER = 0.9  # lowers that limit while there are too many modes
COUNTED = 60  # modes of an open string that answer, at most


def answering_modes(instrument: Instrument) -> tuple[int, ...]:
    """Number of modes of each open string, from its lowest, that may answer other strings; 0 if none do.

    Counted by the pitch of the open string before the bench tuned it, so that every string on the bench keeps its
    number.
    """
    if instrument.player.answering == "off":
        return (0,) * len(instrument.strings)
    pitches = [s.frequency_before(s.open_note - s.shifted) for s in instrument.strings]
    highest = HIGHEST
    while True:
        counts = tuple(min(COUNTED, int(highest / pitch)) for pitch in pitches)
        if 2 * (sum(counts) - min(counts)) <= MAX_ANSWERS:
            return counts
        highest *= LOWER
