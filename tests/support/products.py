"""Makes the compiled products that many tests need: `python tests/support/products.py [module] [plugin]`.

The library of kernels always; by name, or if none is named, the page's module and the plugins' binary, too.
"""

from __future__ import annotations

import subprocess
import sys

NAMES = ("module", "plugin")


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
    else:
        from livebass.compiling import library

        library.library()


if __name__ == "__main__":
    make("kernels")
    for name in sys.argv[1:] or NAMES:
        make(name)
