"""Each error about an out-of-bounds value is one sentence: the name, the rule, the value."""

from __future__ import annotations

import math

import pytest

from livebass.rows.bounds import either, one_of, within


@pytest.mark.parametrize(
    ("value", "options", "said"),
    [
        (20, {}, "takes must be from 1 to 16, not 20"),
        (math.nan, {}, "takes must be from 1 to 16, not nan"),
        (2.5, {"whole": True}, "takes must be a whole number from 1 to 16, not 2.5"),
        (0, {"unit": "Hz"}, "takes must be from 1 to 16 Hz, not 0 Hz"),
    ],
)
def test_a_number_out_of_its_bounds(value: float, options: dict[str, object], said: str) -> None:
    within("takes", 1, 1, 16)
    within("takes", 16, 1, 16, whole=True)
    with pytest.raises(ValueError) as error:
        within("takes", value, 1, 16, **options)  # type: ignore[arg-type]
    assert str(error.value) == said


def test_one_of_several() -> None:
    one_of("style", "slap", ("finger", "slap"))
    with pytest.raises(ValueError) as error:
        one_of("style", "pick", ("finger", "slap", "pop"))
    assert str(error.value) == "style must be finger, slap or pop, not 'pick'"
    assert either([1]) == "1" and either(iter("ab")) == "a or b"
