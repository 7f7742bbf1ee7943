"""The packages of the extra `tab`, and XML by them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from functools import lru_cache
from importlib import import_module
from math import isfinite
from typing import Any

from livebass.system.extras import install
from livebass.tab.model import UnreadableTab

MAX_REASON = 80  # characters of another library's error
MAX_ELEMENTS = 600_000  # in an XML document
# Some programs declare UTF-16 and write UTF-8
FALSE_ENCODING = re.compile(rb"""^((?:\xef\xbb\xbf)?<\?xml[^>]*?) encoding=["']UTF-16["']""", re.IGNORECASE)
PACKAGES = {"guitarpro": "Guitar Pro 3 to 5 files need PyGuitarPro", "defusedxml.ElementTree": "XML needs defusedxml"}


def require(module: str) -> Any:
    """A module of PACKAGES. Raises LookupError with the command that installs it."""
    try:
        return import_module(module)
    except ImportError:
        raise LookupError(f"{PACKAGES[module]}: {install('tab')}") from None


def parsed_xml(data: bytes) -> Any:
    """The root of an XML document, without namespaces.

    Raises UnreadableTab for damage and entities, and LookupError without defusedxml.
    """
    xml = require("defusedxml.ElementTree")
    if data.count(b"<") - data.count(b"</") > MAX_ELEMENTS:
        raise UnreadableTab(f"its XML has more than {MAX_ELEMENTS} elements")
    try:
        root = xml.fromstring(FALSE_ENCODING.sub(rb"\1", data, count=1))
    except xml.ParseError as error:
        line, column = error.position
        raise UnreadableTab(f"is damaged: line {line}, column {column} of its XML") from None
    except (ValueError, LookupError):  # entities, refused by defusedxml; an unknown encoding
        raise UnreadableTab("its XML declares entities or an unknown encoding, which livebass does not read") from None
    if root.tag.startswith("{"):
        for element in root.iter():
            element.tag = element.tag.rpartition("}")[2]
    return root


def damage_error(error: Exception, what: str) -> UnreadableTab:
    """The error for a file in which `error` came up: itself, if it is one, else a line that begins with `what`."""
    if isinstance(error, UnreadableTab):
        return error
    reason = "".join(c for c in str(error) if c.isprintable())[:MAX_REASON]
    return UnreadableTab(f"is damaged: {what} ({reason or type(error).__name__})")


@contextmanager
def checked_reading() -> Iterator[None]:
    """Turns what a reader meets in a damaged score into UnreadableTab."""
    try:
        yield
    except (AttributeError, IndexError, KeyError, TypeError, ValueError, ArithmeticError) as error:
        raise damage_error(error, "a part of its score is missing or has a wrong value") from None


def number(text: str) -> float:
    """The number in a text. Raises ValueError for a text without a finite number."""
    found = float(text)
    if not isfinite(found):
        raise ValueError(f"{text} is not finite")
    return found


@lru_cache(4096)
def exact(text: str) -> Fraction:
    """The number or ratio in a text such as "0.5" or "1/2", to a millionth. Raises ValueError, ZeroDivisionError."""
    above, _, below = text.partition("/")
    return (Fraction(number(above)) / Fraction(number(below or "1"))).limit_denominator(1_000_000)
