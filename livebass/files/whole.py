"""Writes files whole or not at all: under temporary names, moved into place when all are complete."""

from __future__ import annotations

import errno
import os
import re
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Self

from livebass.system.interrupts import hold_signals

try:
    import fcntl
except ImportError:  # Windows, which cannot remove an open file
    fcntl = None  # type: ignore[assignment]

TEMPORARY = "tmp"
_LEFT = re.compile(rf"\.{TEMPORARY}-[0-9a-f]{{8}}")  # a directory that `whole_directory` fills
_output: ContextVar[Output | None] = ContextVar("output", default=None)


class OutputError(OSError):
    """A file cannot be written. The message is one line: name and reason."""


def output_error(path: Path, error: OSError) -> OutputError:
    """Returns the system's `error` as an OutputError about `path`."""
    return OutputError(f"{path}: cannot be written: {error.strerror or error}")


def checked_place(path: Path) -> Path:
    """Follows symbolic links from `path` to the file's real place. Raises OutputError if it cannot be written."""
    _note_request()
    with _said_of(path, "file"):
        place = _past_links(path)
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
        if not os.access(place.parent, os.W_OK):
            raise OutputError(f"{path}: cannot be written: the directory {path.parent} is read-only")
        with tempfile.TemporaryFile(dir=place.parent):  # raises if the file system takes none, as /proc
            pass
    return place


def _past_links(path: Path) -> Path:
    """Follows symbolic links. Raises OSError for links that lead to themselves."""
    place = Path(os.path.realpath(path))
    if place.is_symlink():
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
    return place


@dataclass
class Output:
    """Holds the files that a program finished, as the caller named them, and whether any place was requested."""

    completed: list[Path] = field(default_factory=list)
    requested: bool = False


@contextmanager
def noted_output() -> Iterator[Output]:
    """Yields an Output that notes what checks of places and transactions do within the block."""
    output = Output()
    token = _output.set(output)
    try:
        yield output
    finally:
        _output.reset(token)


def _note_request() -> None:
    """Notes that a file or directory is to be written."""
    if output := _output.get():
        output.requested = True


def _note_completed(*paths: Path) -> None:
    """Notes finished files."""
    if output := _output.get():
        output.completed.extend(paths)


@dataclass(frozen=True)
class _File:
    name: Path  # as the caller named it
    place: Path  # its final path
    temporary: Path  # its path until then


def _beside(place: Path, ending: str) -> Path:
    """Returns a free name in the same directory: moving it to `place` is then just renaming."""
    return place.with_name(f"{_prefix(place, ending)}{os.urandom(4).hex()}")


def _prefix(place: Path, ending: str) -> str:
    return f".{place.name[:40]}.{ending}-"


def _lock_file(path: Path) -> int:
    """Creates a file, locks it for this process while it is open, and returns its descriptor."""
    while True:
        fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
        with suppress(OSError):  # a file system without locks
            if fcntl:
                fcntl.flock(fd, fcntl.LOCK_EX)
        if os.fstat(fd).st_nlink:
            return fd
        os.close(fd)  # another process took it for a leftover before it was locked


def _remove_leftovers(place: Path) -> None:
    """Removes unlocked temporary files of `place`: killed processes left them."""
    form = re.compile(re.escape(_prefix(place, TEMPORARY)) + "[0-9a-f]{8}")
    with suppress(OSError):
        for entry in place.parent.iterdir() if fcntl else ():
            if form.fullmatch(entry.name) and stat.S_ISREG(entry.lstat().st_mode):
                with suppress(OSError), entry.open() as file:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    entry.unlink()


class Transaction:
    """Writes several files as one: `with Transaction() as files: fd, temporary = files.create(path)`.

    Leaving the block without an exception moves every file into place and replaces older ones. After any exception,
    KeyboardInterrupt included, no file appears, older ones stay and nothing is left behind. Signals wait while files
    are moved or removed. If a process is killed, the next one that writes to the same place removes its leftovers; to
    keep data that cannot be made again, such as a recording, pass an `ending` other than `TEMPORARY`.
    """

    def __init__(self, ending: str = TEMPORARY) -> None:
        self._ending = ending  # of the temporary names, before some digits
        self._files: list[_File] = []
        self._made: list[Path] = []  # directories, outermost first
        self._open: list[tuple[int, Path]] = []  # file descriptors and the names of their files
        self._closing = ExitStack()  # closes encoders before the descriptors they write to

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        complete = False
        try:
            if kind is None:
                self._sync()
                complete = True
        finally:
            with hold_signals():
                try:
                    if complete:
                        self._commit()
                finally:
                    self._discard()

    def directory(self, path: Path) -> None:
        """Makes the directory `path` and its parents, if missing; removes them again if no file appears."""
        _note_request()
        with _said_of(path, "directory"):
            place = _past_links(path)
            for directory in reversed([p for p in (place, *place.parents) if not p.exists()]):
                self._made.append(directory)  # before it exists, as in `create`
                try:
                    directory.mkdir()
                except OSError:
                    self._made.pop()
                    raise
            if not place.is_dir():
                raise OutputError(f"{path}: is not a directory")

    def create(self, path: Path) -> tuple[int, Path]:
        """Opens a new file that will become `path`; returns its read-write descriptor and its temporary path.

        Raises OutputError if the file could not be moved to `path` at the end.
        """
        place = checked_place(path)
        file = _File(path, place, _beside(place, self._ending))
        if any(file.place == other.place for other in self._files):
            raise OutputError(f"{path}: would be written twice")
        _remove_leftovers(place)
        self._files.append(file)  # before it exists: an interrupt in between leaves nothing
        try:
            fd = _lock_file(file.temporary)
        except OSError as error:
            raise output_error(path, error) from None
        self._closing.callback(os.close, fd)
        self._open.append((fd, path))
        return fd, file.temporary

    def before_closing(self, action: Callable[[], None]) -> None:
        """Calls `action` before the descriptors opened so far are closed, after exceptions too."""
        self._closing.callback(action)

    def write(self, path: Path, data: bytes) -> None:
        """Writes a whole file at once."""
        fd, _ = self.create(path)
        try:
            with os.fdopen(os.dup(fd), "wb") as file:
                file.write(data)
        except OSError as error:
            raise output_error(path, error) from None

    def write_text(self, path: Path, text: str) -> None:
        """Writes a text in UTF-8; bytes of file names that are not UTF-8 become escapes (\\udce9), as in JSON."""
        self.write(path, text.encode("utf-8", "backslashreplace"))

    def _sync(self) -> None:
        """Forces all data to disk: some disks report only now that they are full."""
        for fd, name in self._open:
            try:
                os.fsync(fd)
            except OSError as error:
                raise output_error(name, error) from None

    def _commit(self) -> None:
        """Moves all files into place. Sets older files aside until the last new one is in place."""
        aside: list[tuple[Path, Path]] = []
        moved: list[_File] = []
        try:
            for file in self._files:
                moved.append(file)
                if file.place.exists() and len(self._files) > 1:
                    old = _beside(file.place, "old")
                    aside.append((old, file.place))
                    os.replace(file.place, old)
                os.replace(file.temporary, file.place)
        except BaseException as error:
            for file in moved:
                if not file.temporary.exists():
                    file.place.unlink(missing_ok=True)
            for old, place in aside:
                if old.exists():
                    os.replace(old, place)
            if isinstance(error, OSError):
                raise output_error(moved[-1].name, error) from None
            raise
        for old, _ in aside:
            old.unlink(missing_ok=True)
        _note_completed(*(file.name for file in self._files))
        self._made.clear()

    def _discard(self) -> None:
        try:
            self._closing.close()
        finally:
            for file in self._files:
                file.temporary.unlink(missing_ok=True)
            for directory in reversed(self._made):
                with suppress(OSError):  # another program has put files into it
                    directory.rmdir()
            for made in (self._open, self._files, self._made):
                made.clear()


def checked_directory(path: Path, replaceable: Callable[[list[Path]], bool]) -> list[Path]:
    """Returns the entries of the directory `path`, which need not exist.

    Raises OutputError if it may not be replaced, or cannot be made or written to.
    """
    _note_request()
    with _said_of(path, "directory"):
        place = _past_links(path)
        if not place.exists():
            trial = Transaction()
            try:
                trial.directory(path)
            finally:
                with hold_signals():
                    trial._discard()
            return []
        if not place.is_dir():
            raise OutputError(f"{path}: is not a directory")
        if not os.access(place, os.W_OK):
            raise OutputError(f"{path}: is read-only")
        there = [entry for entry in sorted(place.iterdir()) if not _LEFT.fullmatch(entry.name)]
    if there and not replaceable(there):
        raise OutputError(f"{path}: holds other files, such as {there[0].name}; name a new or empty directory")
    return there


@contextmanager
def whole_directory(path: Path, replaceable: Callable[[list[Path]], bool]) -> Iterator[Path]:
    """Yields an empty directory to fill. If the block ends without an exception, its content moves to `path`.

    `path` is made if missing; entries for which `replaceable` returns True are replaced. After any exception `path` is
    as it was. Files written in the block need no common transaction; each should have its own, which detects a full
    disk. The next call removes what a killed process left behind. Raises OutputError.
    """
    there = checked_directory(path, replaceable)
    with Transaction() as made, ExitStack() as ended:
        with _said_of(path, "directory"):
            made.directory(path)
            place = _past_links(path)
            _remove_left_directories(place)
            new = place / f".{TEMPORARY}-{os.urandom(4).hex()}"
            ended.callback(_remove_directory, new)  # before it exists: an interrupt in between leaves nothing
            new.mkdir()
            ended.callback(os.close, _hold_directory(new))
        try:
            with noted_output():  # by their temporary names
                yield new
        except OutputError as error:
            raise OutputError(str(error).replace(str(new), str(path))) from None
        with hold_signals():
            with _said_of(path, "directory"):
                _move_in(new, there)
            _note_completed(path)


@contextmanager
def _said_of(path: Path, kind: str) -> Iterator[None]:
    """Turns a system error within the block into an OutputError about `path`; kind: "file" or "directory"."""
    try:
        yield
    except ValueError:  # a zero byte in the name
        raise OutputError(f"{str(path)!r}: is not a {kind} name") from None
    except OutputError:
        raise
    except OSError as error:
        raise output_error(path, error) from None


def _hold_directory(directory: Path) -> int:
    """Opens and locks a directory for this process; returns its descriptor."""
    fd = os.open(directory if fcntl else os.devnull, os.O_RDONLY)
    with suppress(OSError):  # a file system without locks
        if fcntl:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return fd


def _remove_directory(directory: Path) -> None:
    with hold_signals():
        shutil.rmtree(directory, ignore_errors=True)


def _remove_left_directories(place: Path) -> None:
    """Removes temporary directories in `place` that no process has locked."""
    for entry in sorted(place.iterdir()) if fcntl else ():
        if _LEFT.fullmatch(entry.name) and not entry.is_symlink():
            with suppress(OSError):
                fd = os.open(entry, os.O_RDONLY)
                try:
                    fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    shutil.rmtree(entry, ignore_errors=True)
                finally:
                    os.close(fd)


def _move_in(new: Path, there: list[Path]) -> None:
    """Moves all of `new` into its parent directory, and the entries `there` into `new`; all or nothing."""
    entries, old = sorted(new.iterdir()), new / f".old-{os.urandom(4).hex()}"
    moves = [(entry, old / entry.name) for entry in there] + [(entry, new.parent / entry.name) for entry in entries]
    done: list[tuple[Path, Path]] = []
    old.mkdir()
    try:
        for source, target in moves:
            os.replace(source, target)
            done.append((source, target))
    except OSError:
        for source, target in reversed(done):
            os.replace(target, source)
        raise
