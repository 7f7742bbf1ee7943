"""The door to instructions.py: its functions where kernels are compiled, without numba placeholders everywhere else.

Kernels that come compiled need no numba in the process that plays them. [any thread]
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from livebass.compiling import FROM_SOURCE

if FROM_SOURCE or TYPE_CHECKING:
    from livebass.kernels.machine.instructions import *  # noqa: F403
else:

    def __getattr__(name: str) -> Any:
        """Stands for any instruction: it is called only by kernels, or to make another one of it."""
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *_, **__: None
