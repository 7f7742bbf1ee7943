"""Reads the text of preset files and key maps, and parses TOML; errors are one line."""

from __future__ import annotations

import codecs
import os
import re
import stat
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from livebass.files.formats import check_format, rename_keys
from livebass.files.kinds import kind_of
from livebass.rows.units import one_line

LARGEST_FILE = 1_000_000  # bytes
TOML, TEXT = "TOML text file", "text file"
# Common slips in a line of TOML, and what to write
SLIPS = tuple(
    (re.compile(pattern), hint)
    for pattern, hint in (
        (r"[\u2018-\u201f\u00ab\u00bb]", 'write straight quotes (")'),
        (r"=\s*[-+]?\d+,\d", "write a decimal point, not a comma"),
        (r"=\s*[-+]?[\d.]+\s*[^\W\d_e]", 'put a value and its unit in quotes: "34 in"'),
        (r'=\s*"[^"]*\\', "write / for each \\ of a path"),
        (r"=\s*(?!(?:true|false|inf|nan)\b)[^\W\d_]", 'put text in quotes (")'),
    )
)
PLACE = re.compile(r"\(at line (\d+)")  # in an error of tomllib ...
DIGITS = "integer string conversion"  # in Python's, for a number of thousands of digits
NAMES = re.compile(r"\('[^()]*\)")  # ... which may hold a tuple of names
SCALE = "a scale (.scl) is a temperament: give it to --temperament"


class PresetError(ValueError):
    """An unusable preset, key map or tuning.

    The message is one line: file, section.key, value, and what is allowed.
    """

    def __init__(self, message: str) -> None:
        super().__init__(one_line(message))


def shipped_folder() -> Path:
    """The folder of the shipped presets: in the package, or next to it in a checkout."""
    installed = Path(__file__).parents[1] / "presets"
    return installed if installed.is_dir() else Path(__file__).resolve().parents[2] / "presets"


def is_path(name: str) -> bool:
    """True for a path to a user's file, False for the name of a shipped one."""
    return name.endswith(".toml") or "/" in name or os.sep in name


def is_scale(name: str) -> bool:
    """True for the name of a Scala scale file."""
    return name.lower().endswith(".scl")


def file_bytes(path: str, kind: str, shipped: Iterable[str], form: str = TOML) -> bytes:
    """The content of a regular file of at most LARGEST_FILE bytes. Raises PresetError.

    `kind`, such as "preset", the `shipped` names and the `form` are for the message.
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


def decode(label: str, raw: bytes, kind: str, form: str = TOML) -> str:
    """The text of a file called `label`, in UTF-8 or, as from PowerShell, UTF-16. Raises PresetError."""
    encoding = _encoding(raw)
    try:
        return raw.decode(encoding)
    except UnicodeDecodeError as error:
        before = raw[: error.start].decode(encoding, "replace")
        line, column = before.count("\n") + 1, len(before) - before.rfind("\n")
        name = encoding.upper().removesuffix("-SIG")
        if hint := kind_of(raw):
            raise PresetError(f"{label}: {hint}; a {kind} is a {form}") from None
        why = f"not {name} (byte {error.start}: line {line}, column {column})"
        raise PresetError(f"{label}: {why}; a {kind} is a {form}: save it as UTF-8") from None


def _encoding(raw: bytes) -> str:
    """The encoding of a text: by its byte order mark, else by the zero bytes of ASCII in UTF-16."""
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return "utf-16"
    first, second = raw[0::2].count(0), raw[1::2].count(0)
    if max(first, second) > max(len(raw) // 4, 8 * min(first, second)):  # more than half of all characters
        return "utf-16-le" if second > first else "utf-16-be"
    return "utf-8-sig"


def parse(label: str, text: str, kind: str, needs: str) -> dict[str, Any]:
    """The tables of a file called `label`; `needs`: what it needs. Raises PresetError."""
    if not text.strip():
        raise PresetError(f"{label}: empty; a {kind} needs {needs}")
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        why = "nested too deep" if isinstance(error, RecursionError) else _explain(str(error), text)
        hint = kind_of(text.encode())
        raise PresetError(f"{label}: {hint}; a {kind} is a {TOML}" if hint else f"{label}: not TOML: {why}") from None
    try:
        return rename_keys(kind, check_format(kind, data))[0]
    except ValueError as error:
        raise PresetError(f"{label}: {error}") from None


def _explain(error: str, text: str) -> str:
    """An error of tomllib in `text`, with what to write in its place if the slip is a common one."""
    if DIGITS in error:  # advice for programmers
        return "a number has thousands of digits"
    place = PLACE.search(error)
    line = text.split("\n")[int(place[1]) - 1] if place else ""
    hint = next((f"; {hint}" for slip, hint in SLIPS if slip.search(line)), "")
    return NAMES.sub(lambda names: ".".join(re.findall("'([^']*)'", names[0])), error) + hint
