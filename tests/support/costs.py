"""Cases of parametrized tests by their cost."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest

KINDS = {"jazz-finger", "precision-pick", "slap", "fretless", "six-string", "paper-g"}  # a preset of each


def of_each_kind(names: Iterable[str], dear: str = "") -> list[Any]:
    """Returns the presets `names` for `parametrize`, of which one of each kind always runs, and the others are slow.

    So is `dear`, which takes long.
    """
    names = sorted(names)
    return quick(names, KINDS & set(names) - {dear})


def quick(cases: Iterable[Any], always: Collection[Any]) -> list[Any]:
    """Returns `cases` for `parametrize`, of which those in `always` always run and the others are slow.

    One of each kind is enough to tell that something broke, at a part of the cost.
    """
    found = [case if isinstance(case, tuple) else (case,) for case in cases]
    quick_ones = {case if isinstance(case, tuple) else (case,) for case in always}
    assert quick_ones <= set(found)
    return [pytest.param(*case, marks=() if case in quick_ones else pytest.mark.slow) for case in found]
