"""The text of preset files and key maps: reads it, parses TOML, and says in one line why it cannot."""

from __future__ import annotations

import os
import stat
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from livebass.units import one_line

LARGEST_FILE = 1_000_000  # bytes
TOML, TEXT = "TOML text file", "text file"


class PresetError(ValueError):
    """A preset or a key map that cannot be used.

    The message is one line: file, section.key, value, and what is allowed.
    """

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


def is_path(name: str) -> bool:
    """True for a path to a file of one's own, False for the name of what comes with livebass."""
    return name.endswith(".toml") or "/" in name or os.sep in name


def file_bytes(path: str, kind: str, shipped: Iterable[str], form: str = TOML) -> bytes:
    """The content of a regular file of at most LARGEST_FILE bytes. Raises PresetError.

    `kind`, such as "preset", the names of those `shipped` and its `form` are for the message.
    """
    try:
        found = os.stat(path)
        if not stat.S_ISREG(found.st_mode):
            what = "a directory" if stat.S_ISDIR(found.st_mode) else "not a regular file"
            raise PresetError(f"{path}: is {what}; a {kind} is a {form}")
        if found.st_size > LARGEST_FILE:
            raise PresetError(f"{path}: {found.st_size} bytes; a {kind} has at most {LARGEST_FILE}")
        return Path(path).read_bytes()
    except FileNotFoundError:
        raise PresetError(f"{path}: no such file; shipped {kind}s: {', '.join(shipped)}") from None
    except PermissionError:
        raise PresetError(f"{path}: no permission to read it") from None
    except OSError as error:
        raise PresetError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise error if isinstance(error, PresetError) else PresetError(f"{path}: not a file name") from None


def decoded(label: str, raw: bytes, kind: str, form: str = TOML) -> str:
    """The text of a file called `label`. Raises PresetError."""
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise PresetError(f"{label}: not UTF-8 (byte {error.start}); a {kind} is a {form}") from None


def parsed(label: str, text: str, kind: str, needs: str) -> dict[str, Any]:
    """The tables of a file called `label`, which `needs` some. Raises PresetError."""
    if not text.strip():
        raise PresetError(f"{label}: empty; a {kind} needs {needs}")
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        why = "nested too deep" if isinstance(error, RecursionError) else str(error)
        raise PresetError(f"{label}: not TOML: {why}") from None
