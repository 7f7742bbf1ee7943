"""Kernels as plain Python: what a test module prints when a process of its own runs it without the compiled library."""

from __future__ import annotations

import json
from typing import Any

from support.command import module_paths, python_output
from support.places import ROOT


def in_plain_python(module: str) -> Any:
    """Runs the file `module`, which prints JSON, with uncompiled kernels; returns what it printed."""
    return json.loads(python_output(module, env={"LIVEBASS_PLAIN": "1"} | module_paths(ROOT), cwd=ROOT))
