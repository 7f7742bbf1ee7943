#!/usr/bin/env python3
"""Changes constants and signs of the kernels, one at a time, and lists the changes that no test notices.

    python tools/mutate.py                          try 40 random mutants with the engine's tests
    python tools/mutate.py --count 100 --seed 3     try others, and more of them
    python tools/mutate.py --only tension.py        change only files with this path ending; may be repeated
    python tools/mutate.py --minutes 20             stop after this time
    python tools/mutate.py --list                   list all possible changes, make none
    python tools/mutate.py tests/unit/engine/string      choose the tests for pytest
    python tools/mutate.py tests/unit/engine/test_pinned.py    a sieve: survivors change no pinned sound

A mutant changes a number, a sign or a comparison: it doubles a float constant or literal, lowers a whole constant by
one, subtracts an added term (or the reverse), or inverts a comparison. All mutants of a run are compiled at once, each
behind a switch (R. Untch, A. J. Offutt and M. J. Harrold, Mutation analysis using mutant schemata, 1993), in a copy of
the tree: one compilation takes some minutes, and the checkout stays as it is. Without a mutant the tests must pass.
Then the tests run once per mutant, until one fails; the tests of the mutant's own file and room go first. The pinned
sounds, which notice any change but cannot tell right from wrong, run last, for mutants that no other test notices. A
surviving mutant takes as long as all tests; no mutant is started after --minutes.

The exit status is 1 if a mutant survives. That is not always a fault of the tests: doubling a tolerance, or a bound
that is never reached, may do no harm.
"""

from __future__ import annotations

import argparse
import ast
import functools
import importlib
import json
import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent.parent
KERNELS = HERE / "livebass" / "kernels"
TREE = ("livebass", "presets", "tests", "tools", "pyproject.toml", "README.md", "CHANGELOG.md", "docs")
DECORATORS = ("jit", "entry", "inlined", "shared", "fast", "ordered", "apart", "maker")
LEFT = ("records.py", "machine/")  # memory sizes; functions with exact tests of their own
SIZES = ("MAX_STRINGS", "KEYS", "CONTROLLERS", "CHANNELS", "PARAMETERS", "ACTIONS", "TOUCHES", "MAX_EVENTS")
TESTS = ["tests/unit/engine", "tests/unit/plugin/test_instrument.py"]
OWN = {  # tests that go first, by a mutant's file; by its room, if they are outside the engine's
    "bass": "tests/unit/plugin/test_instrument.py",
    "effects/valve.py": "tests/unit/engine/effects/test_valve.py",
    "hands/damping.py": "tests/unit/engine/hands/test_release.py",
    "hands/noise.py": "tests/unit/engine/hands/test_noise.py",
    "player/placing.py": "tests/unit/engine/player/test_placing.py",
    "string/answers.py": "tests/unit/engine/string/test_answering.py",
    "string/handover.py": "tests/unit/engine/string/test_handover.py",
    "string/long_run.py": "tests/unit/engine/string/test_spans.py",
    "string/looks.py": "tests/unit/engine/string/test_spans.py",
    "string/quartet.py": "tests/unit/engine/string/test_spans.py",
    "string/runs.py": "tests/unit/engine/string/test_spans.py",
    "string/tension.py": "tests/unit/engine/string/test_tension.py",
    "string/touch.py": "tests/unit/engine/string/test_fingertips.py",
    "string/turning.py": "tests/unit/engine/string/test_turned.py",
}
PINNED = "tests/unit/engine/test_pinned.py"
ROUNDING = "a tolerance far above rounding and far below any real difference"
DRAWN = "another random number, as good as this one: even about 0, and drawn for nothing else"
SEARCH = "the search for a plate voltage takes other steps to the same nanovolt"
FIRST = "a first guess of the points that stick or slide, which is corrected until it fits"
DISTINCT = "a key, of which no two are alike either way"
GUARD = "no divisor but 0 is as small"
HARMLESS = {  # mutants that no test can notice, by file and description, and why: they are not tried
    ("effects/valve.py", "0.5 -> 1.0 in 0.5 * above"): SEARCH,
    ("effects/valve.py", "0.5 -> 1.0 in 0.5 * below"): SEARCH,
    ("effects/valve.py", "1.0 -> 2.0 in e.amp[j] = 1.0"): "a flag, that is 0 or not",
    ("effects/valve.py", "1.0 -> 2.0 in e.wet == 1.0"): "x + 1 (out - x) is out, but for the last digit",
    ("effects/valve.py", "high + LOAD * plate_current(high, grid) - SUPPLY: - turned"): SEARCH,
    ("effects/valve.py", "high - low: - turned"): SEARCH,
    ("effects/valve.py", "last < 0: turned round"): SEARCH,
    ("effects/valve.py", "last > 0: turned round"): SEARCH,
    ("effects/valve.py", "NEAR = 1e-09 -> 2e-09"): "two nanovolts instead of one",
    ("hands/noise.py", "APART + 2 * knock.frames: + turned"): DRAWN,
    ("hands/noise.py", "APART + 2 * skin.frames: + turned"): DRAWN,
    ("hands/noise.py", "APART = 2199023255552 -> 2199023255551"): DRAWN,
    ("hands/noise.py", "CLICKS_APART + click.frames: + turned"): DRAWN,
    ("hands/noise.py", "CLICKS_APART = 3298534883328 -> 3298534883327"): DRAWN,
    ("hands/noise.py", "ENDINGS_APART + 2 * voice.endings: + turned"): DRAWN,
    ("hands/noise.py", "ENDINGS_APART = 5497558138880 -> 5497558138879"): DRAWN,
    ("hands/noise.py", "QUICKER + EITHER_WAY * drawn: + turned"): DRAWN,
    ("hands/noise.py", "RUBS_APART + rub.drawn: + turned"): DRAWN,
    ("hands/noise.py", "RUBS_APART = 4398046511104 -> 4398046511103"): DRAWN,
    ("player/placing.py", "0.5 + 0.5 * chance(p.seed, draw): + turned"): DRAWN,
    ("player/placing.py", "LEAVING + UNEQUAL * chance(p.seed, draw + 1): + turned"): DRAWN,
    ("player/placing.py", "PLACES_APART + DRAWS * hands.age[i]: + turned"): DRAWN,
    ("player/placing.py", "PLACES_APART = 8796093022208 -> 8796093022207"): DRAWN,
    ("string/answers.py", "1e-300 -> 2e-300 in max(a.pair_share[p], 1e-300)"): GUARD,
    ("string/answers.py", "1e-300 -> 2e-300 in max(sigma * a.sigma[g], 1e-300)"): GUARD,
    ("string/answers.py", "4 * voice.idle + 2 * hands_move(voice) + voice.cut: + turned"): DISTINCT,
    ("string/answers.py", "4 * voice.idle + 2 * hands_move(voice): + turned"): DISTINCT,
    ("string/answers.py", "EVERY = 64 -> 63"): "flows are computed for another interval, too",
    ("string/answers.py", "MAX_FLOW = 0.1 -> 0.2"): "no pair exchanges as much in so few frames",
    ("string/contact.py", "ENOUGH = 1e-06 -> 2e-06"): "what Newton's method leaves is the square of it",
    ("string/contact.py", "FRICTION_ENOUGH = 1e-13 -> 2e-13"): ROUNDING,
    ("string/contact.py", "abs(v.force[m]) < most: turned round"): FIRST,
    ("string/contact.py", "stuck == 2: turned round"): FIRST,
    ("string/contact.py", "v.force[m] > 0.0: turned round"): FIRST,
    ("string/contact.py", "x[i] > 0.0: turned round"): "the sets do not settle, and the points take turns",
    ("string/contact.py", "new - v.force[m]: - turned"): "more turns than are needed",
    ("string/handover.py", "CLOSE = 1e-06 -> 2e-06"): ROUNDING,
    ("string/handover.py", "NEGLIGIBLE = 1e-12 -> 2e-12"): ROUNDING,
    ("string/handover.py", "SAME = 1e-09 -> 2e-09"): ROUNDING,
    ("string/handover.py", "op.length - to.length: - turned"): "the cosine of modes that both strings share turns by "
    "whole turns; in to_shorter, where test_handover notices it, it goes untried, too",
    ("string/quartet.py", "op.padded - split: - turned"): "prepares rows of modes that no string has",
    ("string/quartet.py", "q * q + y * y: + turned"): "does not compile: the root of what may be negative needs sqrtf",
    ("string/quartet.py", "n - w.split: - turned"): "adds modes that rest",
    ("string/touch.py", "0.0001 -> 0.0002 in max(width, 0.0001)"): "HIGHEST leaves fewer modes",
    ("string/touch.py", "1.0 -> 2.0 in is_placed(slot, op, i, t, 1.0)"): "a key, that is not a held note's 0",
    ("string/touch.py", "n - op.split: - turned"): "copies more of a shape than is read",
    ("string/touch.py", "op.padded - op.split: - turned"): "copies more of a row than is read",
}
SWITCH = '''"""The switch of the mutants: the number of the one that is on, 0: none."""

import ctypes
import os

from livebass.compiling import FROM_SOURCE, entry, shared

NUMBER = ctypes.c_int64(int(os.environ.get("LIVEBASS_MUTANT", 0)))  # for all but the library, which has its own


def chosen():
    """For what kernels share with Python, where Python calls it."""
    return NUMBER.value


choose = None
if FROM_SOURCE:
    from llvmlite import binding, ir
    from numba.core import types
    from numba.extending import intrinsic, overload

    WORD, ALONE = ir.IntType(64), "LIVEBASS_FROM_SOURCE" not in os.environ  # single kernels, not the emitter's
    if ALONE:  # numba keeps them on disk for all mutants: each process that loads them puts its own number there
        binding.add_symbol("lb_mutant", ctypes.addressof(NUMBER))

    def word(module):
        if "lb_mutant" in module.globals:
            return module.globals["lb_mutant"]
        made = ir.GlobalVariable(module, WORD, "lb_mutant")
        if not ALONE:
            made.linkage, made.initializer = "linkonce_odr", ir.Constant(WORD, 0)
        return made

    @intrinsic
    def switched(typing):
        def generate(context, builder, signature, given):
            found = builder.load(word(builder.module))
            found.set_metadata("invariant.load", builder.module.add_metadata([]))
            return found

        return types.int64(), generate

    @overload(chosen)
    def _chosen():
        return lambda: switched()

    @intrinsic
    def choose(typing, number):
        def generate(context, builder, signature, given):
            builder.store(given[0], word(builder.module))
            return context.get_dummy_value()

        return types.void(types.int64), generate


@shared
def either(k, usual, other):
    return other if chosen() == k else usual


@shared
def signed(k, x):
    return -x if chosen() == k else x


@shared
def turned_round(k, x):
    return (x == False) if chosen() == k else x  # of arrays, too


@entry("void(int64)")
def choose_mutant(k):
    choose(k)
'''
CHOOSE = """

_unswitched, _switched = library, []


def library(progress=processes.silent):  # noqa: F811
    found = _unswitched(progress)
    if not _switched:
        _switched.append(True)
        address = found("choose_mutant")
        ctypes.CFUNCTYPE(None, ctypes.c_int64)(address)(int(os.environ.get("LIVEBASS_MUTANT", 0)))
    return found
"""
ALONE = "the pinned sounds alone"
RUNNER = '''"""Runs the tests on mutants, each in a copy of this process; writes [number, what notices it]."""

import ctypes
import json
import os
import signal
import sys
import time

import support.source  # noqa: F401, before any kernel

# isort: split
import hypothesis  # noqa: F401
import pytest
import scipy.signal  # noqa: F401

import livebass.cli  # noqa: F401
import livebass.engine.engine
import livebass.live.synth  # noqa: F401
from livebass.compiling.library import library
from livebass.kernels.machine import mutant

CHOOSE = ctypes.CFUNCTYPE(None, ctypes.c_int64)(library()("choose_mutant"))
OPTIONS = ["-x", "-q", "-p", "no:cacheprovider", "-m", "not slow", "--tb=no", "-rfE"]
PARENT = os.getppid()


class Order:
    """Puts tests in the order of these files or folders, others behind them, and the pinned sounds last."""

    def __init__(self, first):
        self.first = first

    def pytest_collection_modifyitems(self, items):
        items.sort(key=lambda item: (item.nodeid.startswith(pinned), self.place(item.nodeid)))

    def place(self, name):
        return next((k for k, begins in enumerate(self.first) if name.startswith(begins)), len(self.first))


def noticed(k, room):
    said = f"said-{k}.txt"
    pid = os.fork()
    if not pid:
        out = os.open(said, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        os.dup2(out, 1)
        os.dup2(out, 2)
        os.environ["LIVEBASS_MUTANT"] = str(k)
        mutant.NUMBER.value = k
        CHOOSE(k)
        status = 3
        try:
            status = int(pytest.main([*OPTIONS, *tests, pinned], plugins=[Order(room)]))
        finally:
            sys.stdout.flush()
            os._exit(status)
    end = time.monotonic() + most
    while not (ended := os.waitpid(pid, os.WNOHANG))[0]:
        if os.getppid() != PARENT:  # which was ended
            os.kill(pid, signal.SIGKILL)
            sys.exit(1)
        if time.monotonic() > end:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)
            return "it hangs"
        time.sleep(0.02)
    with open(said, errors="replace") as lines:
        for line in lines:
            if line.startswith(("FAILED ", "ERROR ")):
                return line.split()[1].removeprefix("tests/")
    if ended[1]:  # it crashes, or pytest does, as in a broken environment: the last line tells
        with open(said, errors="replace") as lines:
            last = [line.strip() for line in lines if line.strip()][-1:]
        return f"status {os.waitstatus_to_exitcode(ended[1])}: {''.join(last)[-80:]}"
    return ""


rooms, tests, pinned, alone, most, minutes = json.loads(sys.argv[1])
begun = time.monotonic()
for k, room in rooms:
    if time.monotonic() - begun > 60 * minutes:
        break
    by = noticed(k, room)
    print(json.dumps([k, alone if k and by.startswith(pinned.removeprefix("tests/")) else by]), flush=True)
'''


@dataclass(frozen=True)
class Mutant:
    """One change: its place and its description."""

    file: str  # relative to the kernels' folder
    line: int
    what: str


Key = tuple[str, str]  # a constant's file and name, or anything else's file and number in it


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=40, help="how many mutants (40)")
    parser.add_argument("--seed", type=int, default=1, help="chooses which (1)")
    parser.add_argument("--only", action="append", default=[], metavar="END", help="files whose path ends so")
    parser.add_argument(
        "--like", action="append", default=[], metavar="TEXT", help="whose line in the list has this text"
    )
    parser.add_argument("--minutes", type=float, default=60.0, help="after which no other mutant is begun (60)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="how many run at once (one a processor)")
    parser.add_argument("--list", action="store_true", help="list what can be changed, and end")
    parser.add_argument("tests", nargs="*", default=TESTS, help=f"what pytest runs ({' '.join(TESTS)})")
    given = parser.parse_args()
    found = {
        key: mutant
        for key, mutant in all_mutants().items()
        if (mutant.file, mutant.what) not in HARMLESS
        and mutant.file.endswith(tuple(given.only) or "")
        and any(text in said(mutant) for text in given.like or [""])
    }
    if not given.list and given.count < len(found):
        kept = random.Random(given.seed).sample(sorted(found), given.count)
        found = {key: found[key] for key in sorted(kept)}
    if given.list:
        print(*map(said, found.values()), sep="\n")
        return
    with tempfile.TemporaryDirectory(prefix="livebass-mutants-") as folder:
        tree = Path(folder) / "tree"
        copy_of_the_tree(tree, {key: number for number, key in enumerate(found, 1)})
        sys.exit(run(tree, list(found.values()), given.tests, given.jobs, given.minutes))


def said(mutant: Mutant) -> str:
    return f"{mutant.file}:{mutant.line}: {mutant.what}"


def run(tree: Path, mutants: list[Mutant], tests: list[str], jobs: int, minutes: float) -> int:
    """Runs the tests on each mutant and prints the results; returns the exit status."""
    start = time.monotonic()
    compiled = subprocess.run(
        [sys.executable, "-c", "from livebass.compiling import library; library.library()"],
        cwd=tree, env=environment(tree), capture_output=True, text=True, check=False,
    )  # fmt: skip
    if compiled.returncode:
        sys.exit(f"the mutants do not compile:\n{compiled.stderr[-3000:]}")
    print(f"{len(mutants)} mutants compiled in {time.monotonic() - start:.0f} s", flush=True)
    begun = time.monotonic()
    for _, by in fates(tree, [(0, [])], tests, 3600.0):
        if by:
            sys.exit(f"without a mutant the tests fail: {by}")
    baseline = time.monotonic() - begun
    print(f"without a mutant the tests take {baseline:.0f} s", flush=True)
    rooms = [(k, room_of(mutant)) for k, mutant in enumerate(mutants, 1)]

    def of(share: list[tuple[int, list[str]]]) -> list[str]:
        return [by for _, by in fates(tree, share, tests, 3 * baseline + 60, minutes, loud=mutants)]

    with ThreadPoolExecutor(jobs) as pool:
        found = [by for each in pool.map(of, (rooms[job::jobs] for job in range(jobs))) for by in each]
    living, pinned = found.count(""), found.count(ALONE)
    tried, late, dead = len(found), len(mutants) - len(found), len(found) - living
    print(f"{tried} mutants: {dead} noticed, {pinned} of them by the pinned sounds alone; {living} live")
    if late:
        print(f"{late} not tried for want of time")
    return 1 if living else 0


def room_of(mutant: Mutant) -> list[str]:
    """Returns the paths of the tests for a mutant's file and room of kernels, those that go first before others."""
    room = mutant.file.split("/")[0]
    return [*filter(None, [OWN.get(mutant.file), OWN.get(room)]), f"tests/unit/engine/{room}/"]


def fates(
    tree: Path,
    rooms: list[tuple[int, list[str]]],
    tests: list[str],
    maximum: float,
    minutes: float = math.inf,
    loud: Sequence[Mutant] = (),
) -> Iterator[tuple[int, str]]:
    """Yields (number, a test that notices it, ALONE or "") per mutant; `rooms`: (number, paths of tests to run first).

    One process loads everything once, and a copy of it runs the tests of each mutant. Tests that take more than
    `maximum` s count as hanging; no mutant starts after `minutes`. `loud`: mutants to print with their results.
    """
    (tree / "runner.py").write_text(RUNNER)
    command = [sys.executable, "runner.py", json.dumps([rooms, tests, PINNED, ALONE, maximum, minutes])]
    with subprocess.Popen(command, cwd=tree, env=environment(tree), stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        for line in process.stdout:
            k, by = json.loads(line)
            if loud:
                print(f"{k:3} {'dies ' if by else 'LIVES'} {said(loud[k - 1])}  [{by}]", flush=True)
            yield k, by
    if process.returncode:
        sys.exit("the tests of the mutants ended early")


def environment(tree: Path) -> dict[str, str]:
    own = {"PYTHONPATH": f"{tree}:{tree / 'tests'}", "NUMBA_CACHE_DIR": str(tree.parent / "cache")}
    return {**os.environ, **own, "MPLBACKEND": "Agg"}


def copy_of_the_tree(tree: Path, numbers: dict[Key, int]) -> None:
    """Writes the tree with these mutants, each switched by its number."""
    for name in TREE:
        if (HERE / name).is_dir():
            shutil.copytree(HERE / name, tree / name, ignore=shutil.ignore_patterns("__pycache__", "built"))
        else:
            shutil.copy(HERE / name, tree / name)
    for file in sources():
        text = file.read_text()
        changing = Changing(file, numbers)
        made = ast.unparse(changing.visit(ast.parse(text)))
        if changing.changed:
            (tree / file.relative_to(HERE)).write_text(with_switch(made))
    (tree / "livebass/kernels/machine/mutant.py").write_text(SWITCH)
    library = tree / "livebass/compiling/library.py"
    library.write_text(library.read_text() + CHOOSE)


def with_switch(text: str) -> str:
    """Adds the switch's import to a kernel's source, after the docstring and imports from __future__."""
    body = ast.parse(text).body
    first = next(k for k, node in enumerate(body) if k and not ast.unparse(node).startswith("from __future__"))
    lines = text.splitlines()
    lines.insert(body[first].lineno - 1, "from livebass.kernels.machine.mutant import either, signed, turned_round")
    return "\n".join(lines) + "\n"


@functools.cache
def sources() -> list[Path]:
    """Lists the kernel files that may be changed."""
    found = (file for file in sorted(KERNELS.rglob("*.py")) if file.name != "__init__.py")
    return [f for f in found if not f.relative_to(KERNELS).as_posix().startswith(LEFT) and f.name not in LEFT]


def all_mutants() -> dict[Key, Mutant]:
    """Returns all possible mutants."""
    found: dict[Key, Mutant] = {}
    for file in sources():
        changing = Changing(file, {})
        changing.visit(ast.parse(file.read_text()))
        found.update({key: mutant for key, mutant in changing.found.items() if key not in found})
    return found


def module_of(file: Path) -> str:
    return file.relative_to(HERE).with_suffix("").as_posix().replace("/", ".")


@functools.cache
def constants(file: Path) -> tuple[tuple[str, Key, object, int], ...]:
    """Returns (name in the file, key, value, line) of the constants that a file's functions can read."""
    return tuple(_constants(file))


def _constants(file: Path) -> Iterator[tuple[str, Key, object, int]]:
    module = importlib.import_module(module_of(file))
    here = file.relative_to(KERNELS).as_posix()
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.Assign) and not isinstance(node.value, ast.Call):
            for target in node.targets:
                names = target.elts if isinstance(target, ast.Tuple) else [target]
                for name in names:
                    if isinstance(name, ast.Name) and name.id.isupper() and name.id not in SIZES:
                        yield name.id, (here, name.id), getattr(module, name.id), node.lineno
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("livebass.kernels"):
            folder = HERE / (node.module or "").replace(".", "/")
            other = folder.with_suffix(".py")
            if other in sources():
                own = {key[1]: (key, value, line) for _, key, value, line in constants(other)}
                for alias in node.names:
                    if alias.name in own:
                        yield alias.asname or alias.name, *own[alias.name]
            for alias in node.names:  # a module, whose constants are attributes
                if (other := folder / f"{alias.name}.py") in sources():
                    for own_name, key, value, line in constants(other):
                        yield f"{alias.asname or alias.name}.{own_name}", key, value, line


def other_value(value: object) -> object:
    """Returns a constant's mutated value; None: it stays."""
    if isinstance(value, bool):
        return None
    if isinstance(value, int):
        return value - 1 if value > 1 else None
    if isinstance(value, float):
        return 2 * value if value and abs(value) < 1e300 else None
    if isinstance(value, tuple) and value and all(isinstance(x, float) for x in value) and any(value):
        return tuple(2 * x for x in value)
    return None


class Changing(ast.NodeTransformer):
    """Finds a file's possible mutants, and puts those with a number behind the switch."""

    def __init__(self, file: Path, numbers: dict[Key, int]) -> None:
        self.file, self.numbers = file.relative_to(KERNELS).as_posix(), numbers
        self.found: dict[Key, Mutant] = {}
        self.changed = False
        self._inside = False
        self._count = 0
        self._around: list[ast.AST] = []  # the nodes around the one that is visited, and itself
        self._constants = {name: (key, value, line) for name, key, value, line in constants(file)}

    def _may_change(self, key: Key, mutant: Mutant, node: ast.expr, new: str) -> ast.expr:
        """Returns `node` or its replacement: `new`, with {k} for the mutant's number and {x} for the node."""
        self.found[key] = mutant
        if key not in self.numbers:
            return node
        self.changed = True
        made = ast.parse(new.format(k=self.numbers[key], x=ast.unparse(node)), mode="eval").body
        return ast.copy_location(made, node)

    def _next(self) -> Key:
        self._count += 1
        return self.file, f"{self._count:04}"

    def visit(self, node: ast.AST) -> Any:
        self._around.append(node)
        made = super().visit(node)
        self._around.pop()
        return made

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        before = self._inside
        self._inside |= any(ast.unparse(d).split("(")[0] in DECORATORS for d in node.decorator_list)
        node.body = [self.visit(statement) for statement in node.body]  # makers have kernels inside
        self._inside = before
        return node

    def visit_Subscript(self, node: ast.Subscript) -> ast.Subscript:
        node.value = self.visit(node.value)  # an index stays
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        if not self._inside or not isinstance(node.value, float) or not (other := other_value(node.value)):
            return node
        around = next(each for each in reversed(self._around[:-1]) if not isinstance(each, ast.UnaryOp))
        within = f" in {ast.unparse(around)}" if isinstance(around, ast.expr | ast.Assign | ast.Return) else ""
        mutant = Mutant(self.file, node.lineno, f"{node.value!r} -> {other!r}{within}")
        return self._may_change(self._next(), mutant, node, f"either({{k}}, {{x}}, {other!r})")

    def visit_Name(self, node: ast.Name) -> ast.expr:
        return self._constant(node, node.id)

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        return self._constant(node, ast.unparse(node))

    def _constant(self, node: ast.Name | ast.Attribute, name: str) -> ast.expr:
        if not self._inside or not isinstance(node.ctx, ast.Load) or name not in self._constants:
            return node
        key, value, line = self._constants[name]
        if (other := other_value(value)) is None:
            return node
        mutant = Mutant(key[0], line, f"{key[1]} = {value!r} -> {other!r}")
        return self._may_change(key, mutant, node, f"either({{k}}, {{x}}, {other!r})")

    def visit_Call(self, node: ast.Call) -> ast.Call:
        if isinstance(node.func, ast.Name) and node.func.id == "range":
            return node
        node.args = [self.visit(argument) for argument in node.args]
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        sites = isinstance(node.op, ast.Add | ast.Sub) and not is_whole(node.left) and not is_whole(node.right)
        key, sign = self._next(), "+" if isinstance(node.op, ast.Add) else "-"
        said = f"{ast.unparse(node)}: {sign} turned"
        node.left = self.visit(node.left)
        node.right = node.right if isinstance(node.op, ast.Pow) else self.visit(node.right)
        if self._inside and sites:
            mutant = Mutant(self.file, node.lineno, said)
            node.right = self._may_change(key, mutant, node.right, "signed({k}, {x})")
        return node

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        key, said = self._next(), ast.unparse(node)
        self.generic_visit(node)
        if not self._inside or len(node.ops) > 1 or isinstance(node.ops[0], ast.Is | ast.IsNot | ast.In | ast.NotIn):
            return node
        return self._may_change(
            key, Mutant(self.file, node.lineno, f"{said}: turned round"), node, "turned_round({k}, {x})"
        )


def is_whole(node: ast.expr) -> bool:
    """True for a whole number, which is probably a count or an index."""
    return isinstance(node, ast.Constant) and isinstance(node.value, int)


if __name__ == "__main__":
    main()
