"""The kernels' sine, cosine, exponential, logarithm and power: exact to an ulp, and the same bits everywhere.

mpmath gives the exact values at 3000 bits, rounded once. First come the worst of a million random arguments in each
range, and those nearest to whole quarter turns.
"""

from __future__ import annotations

import ast
import hashlib
import math
import os
import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import module_paths, python_output
from support.places import ROOT
from support.programs import load

from livebass.compiling import compiled, jit
from livebass.kernels.machine import elementary
from livebass.kernels.string.modal import LANES

ULP = 1.0

EXACT: dict[str, tuple[tuple[float, ...], ...]] = {  # arguments, and the value
    "sin": (
        (91.106186954104, -1.2379612731767154e-18), (182.212373908208, 2.475922546353431e-18),
        (364.424747816416, 4.951845092706862e-18), (-2515.651908010371, -0.6916762687646417),
        (742864.9012309918, -0.6894797236047817), (847918.9987965387, 1.0219980590416112e-10),
        (-0.766551584469152, -0.6936554501648308), (0.7853981633974483, 0.7071067811865475),
        (0.7853981633974484, 0.7071067811865476), (1.5707963267948966, 1.0),
        (3.141592653589793, 1.2246467991473532e-16), (-1000000.0, 0.34999350217129294), (1234.5, 0.14539565052293643),
        (1e-05, 9.999999999833334e-06), (1e-300, 1e-300), (-1.0, -0.8414709848078965),
    ),
    "cos": (
        (45.553093477052, -6.189806365883577e-19), (321307.9594422229, -4.429600834596129e-17),
        (1.5707963267948966, 6.123233995736766e-17), (-1292.0015565364333, -0.6916855857011425),
        (450505.20177435223, 0.6856867493414197), (865921.8954979351, 3.05969557990345e-11),
        (2.3524173146283234, -0.7044308769226338), (0.7853981633974483, 0.7071067811865476),
        (0.7853981633974484, 0.7071067811865475), (3.141592653589793, -1.0), (1000000.0, 0.9367521275331447),
        (1234.5, -0.989373592132422), (1e-05, 0.99999999995), (1e-300, 1.0), (-1.0, 0.5403023058681398),
    ),
    "exp": (
        (-708.7471982646134, 1.5667609162589916e-308), (-708.4241535974435, 2.1642092337243915e-308),
        (-459.2062912390583, 3.7088704144154396e-200), (0.3476744773817728, 1.4157713091374367),
        (-745.1332191019411, 5e-324), (-745.13, 5e-324), (-708.3964185322641, 2.2250738585072626e-308),
        (-740.0, 4.2e-322), (709.782712893384, 1.7976931348622732e308), (709.0, 8.218407461554972e307),
        (0.34657359027997264, 1.414213562373095), (-0.34657359027997264, 0.7071067811865476), (1e-17, 1.0),
        (-1e-09, 0.999999999), (0.5, 1.6487212707001282), (1.0, 2.718281828459045), (-20.0, 2.061153622438558e-09),
        (100.0, 2.6881171418161356e43),
    ),
    "exp2": (
        (-1074.5, 5e-324), (-1073.7, 5e-324), (-1022.5, 1.5733648139913585e-308), (-1022.3, 1.8073215736421466e-308),
        (1023.9999999999999, 1.7976931348621742e308), (1023.5, 1.2711610061536464e308),
        (0.49999999999999994, 1.414213562373095), (0.5, 1.4142135623730951), (-0.5, 0.7071067811865476), (1e-17, 1.0),
        (-1e-09, 0.9999999993068528), (0.1, 1.0717734625362931), (0.3333333333333333, 1.2599210498948732),
        (-33.3, 9.455862412651036e-11), (511.7, 1.0890524120979927e154),
    ),
    "log2": (
        (1.0000000000000002, 3.203426503814917e-16), (0.9999999999999999, -1.6017132519074588e-16),
        (1.0000001, 1.4426949695965583e-07), (0.99999, -1.4427022544056922e-05),
        (0.7071067811865475, -0.5000000000000001), (0.7071067811865476, -0.4999999999999999),
        (1.414213562373095, 0.4999999999999999), (1.4142135623730951, 0.5000000000000001), (5e-324, -1074.0),
        (1.5e-323, -1072.415037499279), (2.225073858507201e-308, -1022.0), (2.2250738585072014e-308, -1022.0),
        (1.7976931348623157e308, 1024.0), (3.0, 1.584962500721156), (10.0, 3.321928094887362),
        (1e-05, -16.609640474436812), (0.1, -3.321928094887362), (1e22, 73.08241808752197),
    ),
    "power": (
        (1.0000000000000002, 3.1e18, 8.740064376489356e298), (0.9999999999999999, -6.3e18, 5.79631480202735e303),
        (1.0000001, 7000000000.0, 1.0141969717459648e304), (0.9, 6700.0, 2.659581133369335e-307),
        (0.7071067811865476, -2046.9, 1.227860595756333e308), (1.4142135623730951, -2147.9, 5e-324),
        (5e-324, 0.95, 7.229286294568597e-308), (1.7976931348623157e308, 0.999, 8.840174632999172e307),
        (1e-300, 1.07, 1e-321), (3e-07, 1.3, 3.3132761257103814e-09), (1.234e-09, 2.3, 3.236121861360385e-21),
        (0.00025, 3.9, 8.952947417938789e-15), (1e-15, 1.1, 3.16227766016837e-17), (7e-06, 1.5, 1.8520259177452135e-08),
        (0.0999, 2.999, 0.0009993023280788873), (2.2250738585072014e-308, 1.0, 2.2250738585072014e-308),
        (2.0, 0.25, 1.189207115002721), (5.0, 0.007936507936507936, 1.0128552440319638),
        (123.4, 0.77, 40.767367933065856), (10.0, -5.0, 1e-05), (3.0, 3.0, 27.0),
    ),
}  # fmt: skip
INF, NAN = math.inf, math.nan
SPECIAL: dict[str, tuple[tuple[float, ...], ...]] = {
    "sin": ((0.0, 0.0), (INF, NAN), (-INF, NAN), (NAN, NAN), (1e300, 0.0), (5e-324, 5e-324)),
    "cos": ((0.0, 1.0), (INF, NAN), (-INF, NAN), (NAN, NAN), (1e300, 1.0), (5e-324, 1.0)),
    "exp": ((0.0, 1.0), (-0.0, 1.0), (INF, INF), (-INF, 0.0), (NAN, NAN), (709.79, INF), (-745.14, 0.0), (1e300, INF)),
    "exp2": ((0.0, 1.0), (INF, INF), (-INF, 0.0), (NAN, NAN), (1024.0, INF), (-1075.0, 0.0), (-1e300, 0.0)),
    "log2": ((0.0, -INF), (-0.0, -INF), (INF, INF), (-INF, NAN), (-1e-300, NAN), (NAN, NAN), (1.0, 0.0)),
    "power": (
        (0.0, 0.0, 1.0), (0.0, 1.3, 0.0), (0.0, -1.3, INF), (-0.0, 2.5, 0.0), (-1.0, 2.0, NAN), (NAN, 1.0, NAN),
        (2.0, NAN, NAN), (NAN, 0.0, 1.0), (1.0, NAN, 1.0), (1.0, INF, 1.0), (INF, 0.0, 1.0), (INF, 1.0, INF),
        (INF, -1.0, 0.0), (2.0, INF, INF), (2.0, -INF, 0.0), (0.5, INF, 0.0), (0.5, -INF, INF), (2.0, 1e300, INF),
        (2.0, 1024.0, INF), (2.0, -1074.0, 5e-324), (2.0, -1076.0, 0.0), (0.5, 1074.0, 5e-324), (1.5, 1.0, 1.5),
    ),
}  # fmt: skip


def ulps(found: float, exact: float) -> float:
    """Returns the number of units in the last place of `exact` between the two."""
    return float(abs(found - exact) / np.spacing(abs(exact)))


@pytest.mark.parametrize("name", EXACT)
def test_values_are_exact_to_an_ulp(name: str) -> None:
    function = getattr(elementary, name)
    found = [(*given, function(*given), exact) for *given, exact in EXACT[name]]
    wrong = [case for case in found if not ulps(*case[-2:]) <= ULP]
    assert not wrong, f"arguments of {name}, found, exact: {wrong}"


@pytest.mark.parametrize("name", SPECIAL)
def test_special_values(name: str) -> None:
    found = [getattr(elementary, name)(*given) for *given, _ in SPECIAL[name]]
    np.testing.assert_array_equal(found, [case[-1] for case in SPECIAL[name]])


def test_whole_powers_of_two_are_exact() -> None:
    for k in range(-1074, 1024):
        exact = math.ldexp(1.0, k)
        assert elementary.exp2(float(k)) == exact
        assert elementary.log2(exact) == k


@compiled()
def fill(kind, x, out):
    """Fills `out` with function number `kind` of each value, in a loop that becomes vector instructions."""
    for i in range(x.size):
        if kind == 0:
            out[i] = elementary.sin(x[i])
        elif kind == 1:
            out[i] = elementary.cos(x[i])
        elif kind == 2:
            out[i] = elementary.exp(x[i])
        elif kind == 3:
            out[i] = elementary.exp2(x[i])
        elif kind == 4:
            out[i] = elementary.log2(x[i])
        else:
            out[i] = elementary.power(x[i], 1.3)


@compiled(fastmath=LANES)
def fill_loosely(x, sines, cosines, exponentials):
    """Compiled like modal.py's loops: the caller's own sums may be reordered, the functions' may not."""
    for i in range(x.size):
        sines[i], cosines[i] = elementary.sin_cos(x[i])
        exponentials[i] = elementary.exp(-x[i])


KINDS = ("sin", "cos", "exp", "exp2", "log2")


def values(kind: int, x: np.ndarray) -> np.ndarray:
    out = np.empty_like(x)
    fill(kind, x, out)
    return out


def neighbours(x: float) -> np.ndarray:
    """Returns 2001 consecutive numbers around `x`, ascending."""
    word = np.float64(x).view(np.int64)
    return np.sort((word + np.arange(-1000, 1001)).view(np.float64))


@pytest.mark.parametrize(
    "name, x",
    [
        *(("exp", k * math.log(2)) for k in (0.5, -0.5, 1.5, -20.5, 700.5, -1022.5)),
        *(("exp2", k) for k in (0.5, -0.5, 1.5, 100.5, -1021.5, -1022.0)),
        *(("log2", x) for x in (0.5, math.sqrt(0.5), 1.0, math.sqrt(2.0), 1e-300, 3e-308)),
        *(("sin", x) for x in (0.25 * math.pi, -0.25 * math.pi, 6.25 * math.pi, 1000.25 * math.pi)),
        *(("cos", x) for x in (-0.25 * math.pi, 1.25 * math.pi, 999.5 * math.pi)),
    ],
)
def test_no_step_down_where_the_parts_meet(name: str, x: float) -> None:
    """All grow at these places, and every fourth number differs enough from the last to show it."""
    found = values(KINDS.index(name), neighbours(x)[::4])
    assert np.all(np.diff(found) >= 0)
    assert found[-1] > found[0]


def test_sine_and_cosine_belong_together() -> None:
    x = np.random.default_rng(1).uniform(-3000, 3000, 1001)
    sines, cosines = values(0, x), values(1, x)
    assert np.max(np.abs(sines**2 + cosines**2 - 1)) < 4e-16
    assert np.array_equal(values(0, -x), -sines)
    assert np.array_equal(values(1, -x), cosines)
    assert [elementary.sin_cos(v) for v in x] == list(zip(sines, cosines, strict=True))


def test_loops_and_callers_with_fastmath_give_the_bits_of_single_calls() -> None:
    x = np.random.default_rng(2).uniform(0, 700, 1003)
    for kind, name in enumerate(KINDS):
        assert np.array_equal(values(kind, x), [getattr(elementary, name)(v) for v in x])
    assert np.array_equal(values(5, x), [elementary.power(v, 1.3) for v in x])
    sines, cosines, exponentials = np.empty_like(x), np.empty_like(x), np.empty_like(x)
    fill_loosely(x, sines, cosines, exponentials)
    assert np.array_equal(sines, values(0, x))
    assert np.array_equal(cosines, values(1, x))
    assert np.array_equal(exponentials, values(2, -x))


@pytest.mark.parametrize("decorate", [jit, elementary.joined], ids=["jit", "joined"])
def test_a_caller_with_fastmath_that_comes_first_changes_nothing(decorate: Callable[..., Any]) -> None:
    """numba compiles a function once, for its first caller: its sums must not become reorderable for all others."""

    @decorate
    def rounded(x):
        return (x + elementary.MAGIC) - elementary.MAGIC

    @compiled(fastmath=LANES)
    def loose(x):
        return rounded(x)

    @jit
    def strict(x):
        return rounded(x)

    assert loose(2.3) == strict(2.3) == 2.0


def digest() -> str:
    """Returns a hash of 60000 results: every machine must give the same bits."""
    rng = np.random.Generator(np.random.PCG64(5))  # integers: the same everywhere
    unit = rng.integers(-(1 << 52), 1 << 52, 10_000) * 2.0**-52
    spans = (1e4, 1e6, 740.0, 1070.0)
    parts = [values(kind, unit * span) for kind, span in enumerate(spans)]
    parts += [values(4, np.abs(unit) * 2.0**40), values(5, np.abs(unit) * 2.0**-12)]
    return hashlib.sha256(np.concatenate(parts).astype("<f8").tobytes()).hexdigest()[:16]


DIGEST = "eb008589a13ee5fa"


def test_the_bits_are_the_same_on_every_processor() -> None:
    assert digest() == DIGEST


@pytest.mark.skipif(platform.machine().lower() not in ("x86_64", "amd64"), reason="names an x86 processor")
def test_the_bits_are_the_same_without_newer_instructions(tmp_path: Path) -> None:
    """Compiled for the oldest processor: no fused multiply-add, two lanes."""
    code = f"import runpy; print(runpy.run_path({os.fspath(__file__)!r})['digest']())"
    env = {"NUMBA_CPU_NAME": "x86-64-v2", "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": str(tmp_path)}
    env |= {"LIVEBASS_FROM_SOURCE": "1"} | module_paths(ROOT)
    assert python_output("-c", code, env=env).split() == [DIGEST]


def test_the_constants_are_those_that_are_derived() -> None:
    derived = load("elementary").constants()
    assert derived
    for name, numbers in derived.items():
        names = [name] if len(numbers) == 1 else [f"{name}{i}" for i in range(len(numbers))]
        assert [getattr(elementary, name) for name in names] == numbers


# The numpy and math functions allowed in kernels: IEEE defines the result, and processors have them.
EXACT_CALLS = {"sqrt", "floor", "ceil", "rint", "isinf", "isnan", "absolute", "minimum"}
MODULES, ALIASES = ("math", "cmath", "numpy"), (None, "np")


def foreign(source: str) -> list[str]:
    """Returns the calls in a kernel's source, with lines, whose last bits would depend on the system."""
    found = []
    for node in ast.walk(ast.parse(source)):
        name = ""
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            member: Callable[..., float] | None = None
            if node.value.id in ("math", "cmath"):
                member = getattr(math, node.attr, None)
            elif node.value.id in ("np", "numpy"):
                member = getattr(np, node.attr, None)
                member = member if isinstance(member, np.ufunc) else None
            if callable(member) and node.attr not in EXACT_CALLS:
                name = f"{node.value.id}.{node.attr}"
        elif isinstance(node, ast.ImportFrom) and node.module in MODULES:
            name = f"from {node.module}"
        elif isinstance(node, ast.Import):
            name = " ".join(f"import {a.name} as" for a in node.names if a.name in MODULES and a.asname not in ALIASES)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "pow":
            name = "pow"
        elif isinstance(node, (ast.BinOp, ast.AugAssign)) and isinstance(node.op, ast.Pow):
            exponent = node.right if isinstance(node, ast.BinOp) else node.value
            try:  # an integer power is a few products
                whole = isinstance(ast.literal_eval(exponent), int)
            except ValueError:
                whole = False
            if not whole:
                name = "**"
        if name:
            found.append(f"{node.lineno}: {name}")
    return sorted(found)


def test_kernels_call_these_alone() -> None:
    rooms = [ROOT / "livebass" / room for room in ("kernels", "live/thread")]
    files = [file for room in rooms for file in room.rglob("*.py")]
    assert len(files) > 10
    found = [f"{file.relative_to(ROOT)}:{line}" for file in files for line in foreign(file.read_text("utf-8"))]
    assert not found


@pytest.mark.parametrize(
    "source",
    [
        "x = np.exp(y)", "x = numpy.sin(y)", "x = math.cos(y)", "x = np.power(y, 2)", "x = np.log2(y)", "x = y ** z",
        "x = 2.0 ** y", "x = y ** 0.25", "x **= z", "x = pow(y, z)", "from math import sin", "from numpy import exp",
        "import math as m", "f = np.tanh",
    ],
)  # fmt: skip
def test_other_calls_would_be_found(source: str) -> None:
    assert foreign(source)


def test_exact_calls_are_not_found() -> None:
    assert not foreign(
        "import numpy as np\nx = np.sqrt(y) + np.floor(y) + y ** 2 + 2.0 ** -52 + np.float64(1) + math.pi"
    )
