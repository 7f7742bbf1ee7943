"""Makes numba compile single kernels in this process, for tests that call them. Import it before any kernel.

The kernels are kept on disk, keyed by their sources. Commands started by tests compile none: the environment is
unchanged.
"""

from __future__ import annotations

import functools
import hashlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

assert "livebass.compiling" not in sys.modules
os.environ["LIVEBASS_FROM_SOURCE"] = "1"

from livebass import compiling  # noqa: E402
from livebass.compiling import by_numba, store  # noqa: E402

del os.environ["LIVEBASS_FROM_SOURCE"]
assert compiling.FROM_SOURCE


@functools.cache
def directory() -> Path | None:
    """The folder for single kernels, by all sources and the inputs of `by_numba`; None: nowhere."""
    place = by_numba.directory()
    name = hashlib.sha256((store.digest() + (place.name if place else "")).encode()).hexdigest()
    return store.directory(f"reference-{name[:16]}")


@functools.cache
def folder(module: str, file: str) -> str:
    """The folder for a module's functions; for a test's, keyed also by its file and the files that tests share."""
    name = hashlib.sha256(module.encode())
    for source in () if module.startswith("livebass.") else (file, *sorted(Path(__file__).parent.glob("*.py"))):
        name.update(Path(source).read_bytes())
    return str(directory() / name.hexdigest()[:16])  # type: ignore[operator]


class Locator(by_numba._Locator):
    def __init__(self, function: Callable[..., Any], file: str) -> None:
        super().__init__(function, file)
        self._cache_path = folder(function.__module__, file)


class Results(by_numba._Results):
    _locator_classes: Any = (Locator,)


class Cache(by_numba._Cache):
    _impl_class = Results


def keep(kernel: Callable[..., Any]) -> Callable[..., Any]:
    """`by_numba.kernel`; keeps its functions except those compiled into others."""

    def kept(attributes: str = "", **options: Any) -> Callable[[Callable[..., Any]], Any]:
        def decorate(function: Callable[..., Any]) -> Any:
            made = kernel(attributes, **options)(function)
            if "inline" not in options and directory():
                made._cache = Cache(function)
            return made

        return decorate

    return kept


by_numba.kernel = keep(by_numba.kernel)
