"""Makes the compiled products that many tests need: `python tests/support/products.py [NAME...]`.

The library of kernels always; by name, or if none is named, the page's module, the plugins' binary and the reference
solver, too.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

NAMES = ("module", "plugin", "reference")


def begin(*names: str) -> subprocess.Popen[bytes]:
    """Starts a process that makes the library of kernels and the products `names`."""
    return subprocess.Popen([sys.executable, __file__, "kernels", *names], stderr=subprocess.DEVNULL)


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
        from livebass.reference.solver import solve
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
