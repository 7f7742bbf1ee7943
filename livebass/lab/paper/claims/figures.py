"""The statements that fail, as `livebass study claims` found. README, handbook and notes quote them; tests measure.

When a result changes, measure again, and correct the numbers here and the sentences that the tests then name.
"""

from __future__ import annotations

FAILING = ("nut-last-fret",)  # over all plucks
MISSED = ("soft-glide-size", "neck-conductance")  # ticks of axes, which do not count
FAILING_ALONE = ("soft-longer", "soft-decrease")  # with the paper's own pluck alone: `--plucks 0`
