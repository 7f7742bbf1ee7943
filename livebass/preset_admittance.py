"""The neck's admittance of a preset: a measured table or resonances, for the open string."""

from __future__ import annotations

from typing import Any

from livebass.admittance import MOST_SHAPE, Admittance, Resonance

TABLE = {"conductance_frequencies", "conductance_values", "susceptance_values"}
RESONANCES = {"resonance_frequencies", "resonance_qualities", "resonance_masses", "resonance_shapes"}


class Misfit(ValueError):
    """Keys that do not go together: the one at fault, and why."""

    def __init__(self, key: str, why: str, *raw: object) -> None:
        super().__init__(f"{key}: {why}")
        self.key, self.why, self.raw = key, why, raw


def replaced(own: set[str]) -> set[str]:
    """Which of the shared neck's keys are void where the neck of one string has the keys `own`."""
    void: set[str] = set()
    for kind, other in ((TABLE, RESONANCES), (RESONANCES, TABLE)):
        if own & kind:
            void |= other
        if own & kind & {"conductance_frequencies", "resonance_frequencies"}:
            void |= kind
    return void


def neck_admittance(values: dict[str, Any]) -> Admittance:
    """What the checked values of a neck, in SI, say; nothing gives way where they say nothing. Raises Misfit."""
    if values.keys() & TABLE and values.keys() & RESONANCES:
        key = sorted(values.keys() & RESONANCES)[0]
        raise Misfit(key, "resonances are not allowed together with a table of conductances")
    nu, real = _columns(values, "conductance_frequencies", "conductance_values")
    imaginary = values.get("susceptance_values", (0.0,) * len(nu))
    _as_many("susceptance_values", imaginary, "conductance_frequencies", nu)
    hertz, quality = _columns(values, "resonance_frequencies", "resonance_qualities")
    _, mass = _columns(values, "resonance_frequencies", "resonance_masses")
    shapes = values.get("resonance_shapes", tuple(min(k, MOST_SHAPE) for k in range(1, len(hertz) + 1)))
    _as_many("resonance_shapes", shapes, "resonance_frequencies", hertz)
    resonances = tuple(Resonance(*row) for row in zip(hertz, quality, mass, shapes, strict=True))
    return Admittance(resonances, tuple(zip(nu, real, imaginary, strict=True)))


def _columns(values: dict[str, Any], first: str, second: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    a, b = values.get(first, ()), values.get(second, ())
    _as_many(second, b, first, a)
    return a, b


def _as_many(key: str, given: tuple[Any, ...], first: str, wanted: tuple[Any, ...]) -> None:
    if len(given) != len(wanted):
        raise Misfit(key, f"{len(given)} for {len(wanted)} {first}, must be as many")
