"""Parametrized test cases by cost."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest

# One preset of each kind; tests/unit/engine/test_pinned.py has the sound of every preset
KINDS = {"jazz-finger", "precision-pick", "slap", "fretless", "paper-g"}


def of_each_kind(names: Iterable[str], dear: str = "") -> list[Any]:
    """Returns the presets `names` for `parametrize`: one of each kind always runs, the others are slow.

    The preset `dear`, which takes long, is slow too.
    """
    names = sorted(names)
    return quick(names, KINDS & set(names) - {dear})


def slow(*case: Any) -> Any:
    """A case for `parametrize` that runs only with the slow tests."""
    return pytest.param(*case, marks=pytest.mark.slow)


def quick(cases: Iterable[Any], always: Collection[Any]) -> list[Any]:
    """Returns `cases` for `parametrize`: those in `always` always run, the others are slow.

    One of each kind shows that something broke, at a fraction of the cost.
    """
    found = [case if isinstance(case, tuple) else (case,) for case in cases]
    quick_ones = {case if isinstance(case, tuple) else (case,) for case in always}
    assert quick_ones <= set(found)
    return [pytest.param(*case, marks=() if case in quick_ones else pytest.mark.slow) for case in found]
