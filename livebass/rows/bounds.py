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


def between(least: float, most: float, unit: str = "", whole: bool = False) -> str:
    """A range in words: "from 1 to 16", "a whole number from 1 to 16", "from 20 to 700 Hz"."""
    return f"{'a whole number ' * whole}from {least:.10g} to {most:.10g} {unit}".rstrip()


def either(choices: Iterable[object]) -> str:
    """The choices in words: "A, B or C"."""
    *most, last = map(str, choices)
    return f"{', '.join(most)} or {last}" if most else last


def within(name: str, value: float, least: float, most: float, unit: str = "", whole: bool = False) -> None:
    """Raises ValueError for a number below `least`, above `most`, NaN, or, with `whole`, not a whole number."""
    if not least <= value <= most or (whole and value != int(value)):
        raise refusal(name, between(least, most, unit, whole), f"{value:.10g} {unit}".rstrip())


def one_of(name: str, value: object, choices: Iterable[object]) -> None:
    """Raises ValueError for a value that is not among the choices."""
    if value not in (choices := tuple(choices)):
        raise refusal(name, either(choices), repr(value))
