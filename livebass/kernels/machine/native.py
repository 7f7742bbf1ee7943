"""The door to instructions.py: its functions where kernels are compiled, plain.py's where they run uncompiled.

Everywhere else placeholders stand for them: kernels that come compiled need no numba in the process that plays them.
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
        """Stands for any instruction: it is called only by kernels, or to make another one of it."""
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *_, **__: None
