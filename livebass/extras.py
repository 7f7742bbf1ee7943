"""Tells how to install what an extra of livebass needs."""

from __future__ import annotations

import shlex
import sys


def install(extras: str) -> str:
    """The command that installs `extras`, such as "live" or "analysis,plots", for the Python that runs."""
    return f"{shlex.quote(sys.executable or 'python')} -m pip install 'livebass[{extras}]'"
