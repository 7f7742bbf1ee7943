"""Checks values against their bounds. Every error is one sentence: "takes must be from 1 to 16, not 20"."""

from __future__ import annotations

from collections.abc import Iterable


def refusal(name: str, rule: str, value: object) -> ValueError:
    """The error for a `value` of `name` that breaks the `rule`."""
    return ValueError(f"{name} must be {rule}, not {value}")


def complaint(name: str, why: object, *shown: str) -> str:
    """Says why a value is wrong: "name must be ..., not shown" or "name = shown: why"; `shown` may be missing."""
    if str(why).startswith("must be "):
        return f"{name} {why}{''.join(f', not {value}' for value in shown)}"
    return f"{name}{''.join(f' = {value}' for value in shown)}: {why}"


def between(minimum: float, maximum: float, unit: str = "", whole: bool = False) -> str:
    """A range in words: "from 1 to 16", "a whole number from 1 to 16", "from 20 to 700 Hz"."""
    return f"{'a whole number ' * whole}from {minimum:.10g} to {maximum:.10g} {unit}".rstrip()


def either(choices: Iterable[object]) -> str:
    """The choices in words: "A, B or C"."""
    *maximum, last = map(str, choices)
    return f"{', '.join(maximum)} or {last}" if maximum else last


def within(name: str, value: float, minimum: float, maximum: float, unit: str = "", whole: bool = False) -> None:
    """Raises ValueError for a number below `minimum`, above `maximum`, NaN, or, with `whole`, not a whole number."""
    if not minimum <= value <= maximum or (whole and value != int(value)):
        raise refusal(name, between(minimum, maximum, unit, whole), f"{value:.10g} {unit}".rstrip())


def one_of(name: str, value: object, choices: Iterable[object]) -> None:
    """Raises ValueError for a value that is not among the choices."""
    if value not in (choices := tuple(choices)):
        raise refusal(name, either(choices), repr(value))
