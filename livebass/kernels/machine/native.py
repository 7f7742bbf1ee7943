"""Chooses the kernels' instructions: instructions.py to compile kernels, plain.py to run them uncompiled.

Otherwise they are placeholders: a process that plays precompiled kernels needs no numba.
[any thread]
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from livebass.compiling import FROM_SOURCE, PLAIN

if FROM_SOURCE or TYPE_CHECKING:
    from livebass.kernels.machine.instructions import *  # noqa: F403
elif PLAIN:
    from livebass.kernels.machine.plain import *  # noqa: F403
else:

    def __getattr__(name: str) -> Any:
        """A placeholder for any instruction: only kernels call it, or makers of further ones."""
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *_, **__: None
