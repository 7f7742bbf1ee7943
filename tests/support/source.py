"""Has numba compile single kernels in this process, for tests that call them. To be imported before any kernel.

Commands that tests start do not: the environment is as it was.
"""

from __future__ import annotations

import os
import sys

assert "livebass.compiling" not in sys.modules
os.environ["LIVEBASS_FROM_SOURCE"] = "1"

from livebass import compiling  # noqa: E402

del os.environ["LIVEBASS_FROM_SOURCE"]
assert compiling.FROM_SOURCE
