"""Files that appear whole or not at all: written beside their place, moved there when all are complete."""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self


class OutputError(OSError):
    """A file cannot be written; one line with its name and the reason."""


def output_error(path: Path, error: OSError) -> OutputError:
    """`error` of the system, said of `path`."""
    return OutputError(f"{path}: cannot be written: {error.strerror or error}")


def checked_place(path: Path) -> Path:
    """Where a file written as `path` goes, past symbolic links. OutputError where it cannot be written."""
    try:
        place = Path(os.path.realpath(path))
        if place.exists():
            kind = place.stat().st_mode
            if stat.S_ISDIR(kind):
                raise OutputError(f"{path}: is a directory; name a file in it")
            if not stat.S_ISREG(kind):
                raise OutputError(f"{path}: is not a regular file")
            if not os.access(place, os.W_OK):
                raise OutputError(f"{path}: is read-only")
        elif not place.parent.is_dir():
            raise OutputError(f"{path}: there is no directory {path.parent}")
        elif not os.access(place.parent, os.W_OK):
            raise OutputError(f"{path}: the directory {path.parent} is read-only")
    except ValueError:  # a zero byte in the name
        raise OutputError(f"{str(path)!r}: is not a file name") from None
    except OutputError:
        raise
    except OSError as error:
        raise output_error(path, error) from None
    return place


def _beside(place: Path, ending: str) -> Path:
    """A name in the same directory, so that moving is renaming, that no other file has."""
    return place.with_name(f".{place.name[:40]}.{ending}-{secrets.token_hex(4)}")


class Transaction:
    """Several new files as one: `with Transaction() as files: fd, temporary = files.create(path)`.

    Leaving the block without an exception moves every file to its place, over an older one; with any
    exception, KeyboardInterrupt included, none appears, older ones stay and nothing is left behind.
    """

    def __init__(self) -> None:
        self._files: list[tuple[Path, Path]] = []  # (temporary, place)
        self._open: list[int] = []  # file descriptors
        self._closing = ExitStack()  # closes what writes to a descriptor, then the descriptor

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._commit()
        finally:
            self._discard()

    def create(self, path: Path) -> tuple[int, Path]:
        """A descriptor to read and write a new file that will be `path`, and where it is until then.

        Raises OutputError where `path` could not be put in place at the end.
        """
        place = checked_place(path)
        if any(place == other for _, other in self._files):
            raise OutputError(f"{path}: would be written twice")
        temporary = _beside(place, "tmp")
        self._files.append((temporary, place))  # before it exists: an interrupt in between leaves nothing
        try:
            fd = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
        except OSError as error:
            raise output_error(path, error) from None
        self._closing.callback(os.close, fd)
        self._open.append(fd)
        return fd, temporary

    def before_closing(self, action: Callable[[], None]) -> None:
        """Call `action` before the descriptors made so far are closed, whatever the end."""
        self._closing.callback(action)

    def write(self, path: Path, data: bytes) -> None:
        """A whole small file at once."""
        fd, _ = self.create(path)
        try:
            with os.fdopen(os.dup(fd), "wb") as file:
                file.write(data)
        except OSError as error:
            raise output_error(path, error) from None

    def _commit(self) -> None:
        """Move all to their places. What they replace is set aside until the last one is in its place."""
        aside: list[tuple[Path, Path]] = []
        moved: list[Path] = []
        try:
            for fd in self._open:
                os.fsync(fd)  # some disks report that they are full only now
            for temporary, place in self._files:
                if place.exists() and len(self._files) > 1:
                    old = _beside(place, "old")
                    aside.append((old, place))
                    os.replace(place, old)
                moved.append(place)
                os.replace(temporary, place)
        except BaseException as error:
            for place in moved:
                place.unlink(missing_ok=True)
            for old, place in aside:
                if old.exists():
                    os.replace(old, place)
            if isinstance(error, OSError):
                raise output_error(self._files[max(0, len(moved) - 1)][1], error) from None
            raise
        for old, _ in aside:
            old.unlink(missing_ok=True)

    def _discard(self) -> None:
        self._closing.close()
        self._open.clear()
        for temporary, _ in self._files:
            temporary.unlink(missing_ok=True)
        self._files.clear()
