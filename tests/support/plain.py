"""Kernels as plain Python: what a test module prints when a process of its own runs it without the compiled library."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

from support.places import ROOT


def in_plain_python(module: str) -> Any:
    """Runs the file `module`, which prints JSON, with uncompiled kernels; returns what it printed."""
    found = subprocess.run(
        [sys.executable, module],
        env={**os.environ, "LIVEBASS_PLAIN": "1", "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])},
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert found.returncode == 0, found.stderr[-3000:]
    return json.loads(found.stdout)
