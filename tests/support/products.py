"""Makes the compiled products that many tests need: `python tests/support/products.py [NAME...]`.

The library of kernels always; by name, or if none is named, the page's module, the plugins' binary and the reference
solver, too.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path

NAMES = ("module", "plugin", "reference")
# The tests that need a product, and those that need no kernels, by the beginnings of their node ids
NEEDED = {
    "plugin": (
        "tests/unit/plugin/", "tests/hosted/", "tests/real/host/", "tests/real/window/",
        "tests/promises/cli/test_export.py",
    ),
    "module": ("tests/unit/web/", "tests/real/browser/"),
}  # fmt: skip
WITHOUT_KERNELS = ("tests/unit/analysis/", "tests/unit/identification/", "tests/unit/reference/")


def needed(tests: Sequence[str]) -> list[str]:
    """The products that `tests` need, by their node ids."""
    found = [product for product, places in NEEDED.items() if any(test.startswith(places) for test in tests)]
    return found if all(test.startswith(WITHOUT_KERNELS) for test in tests) else ["kernels", *found]


def begin(*names: str) -> subprocess.Popen[bytes]:
    """Starts a process that makes the library of kernels and the products `names`."""
    return subprocess.Popen([sys.executable, __file__, "kernels", *names], stderr=subprocess.DEVNULL)


begin_once = cache(begin)


@cache
def have(name: str) -> None:
    """Makes a product if needed: one of several processes makes it, and the others wait."""
    from livebass.compiling import library, store

    with suppress(OSError):
        if name != "kernels":
            make(name)
        elif store.kept_library() and not library.is_cached():  # in a process of its own, which imports numba
            begin().wait()


def make(name: str) -> None:
    """Makes a product, unless it is kept already. Raises OSError if it cannot be made."""
    if name == "module":
        from livebass.web import build as page

        page.module()
    elif name == "plugin":
        from livebass.plugin import build
        from livebass.plugin.systems import this_system

        build.binary(this_system())
    elif name == "reference":
        from livebass.lab.reference.solver import solve
        from support.strings import tiny

        solve(tiny(), energy_every=50)
    else:
        from livebass.compiling import library

        library.library()


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
    make("kernels")
    for name in sys.argv[1:] or NAMES:
        make(name)
