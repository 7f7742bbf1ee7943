"""Cases of parametrized tests by their cost."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest


def quick(cases: Iterable[Any], always: Collection[Any]) -> list[Any]:
    """Returns `cases` for `parametrize`, of which those in `always` always run and the others are slow.

    One of each kind is enough to tell that something broke, at a part of the cost.
    """
    found = [case if isinstance(case, tuple) else (case,) for case in cases]
    quick_ones = {case if isinstance(case, tuple) else (case,) for case in always}
    assert quick_ones <= set(found)
    return [pytest.param(*case, marks=() if case in quick_ones else pytest.mark.slow) for case in found]
