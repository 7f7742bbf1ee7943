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
from xml.etree.ElementTree import TreeBuilder

from livebass.system.extras import install
from livebass.tab.model import UnreadableTab, shown

MAX_SHOWN = 40  # characters of a wrong number
MAX_ELEMENTS = MAX_ATTRIBUTES = 600_000  # in an XML document
MAX_NAMESPACE = 1000  # characters: the parser copies them for each element
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

    Raises UnreadableTab for damage, for entities and what else makes a small document large, and LookupError without
    defusedxml.
    """
    xml = require("defusedxml.ElementTree")
    if data.count(b"<") - data.count(b"</") > MAX_ELEMENTS:
        raise UnreadableTab(f"its XML has more than {MAX_ELEMENTS} elements")
    if data.count(b"=") > MAX_ATTRIBUTES:
        raise UnreadableTab(f"its XML has more than {MAX_ATTRIBUTES} attributes")
    parser = xml.XMLParser(target=TreeBuilder())
    parser.parser.StartNamespaceDeclHandler = _refuse_long
    parser.parser.AttlistDeclHandler = _refuse_default
    try:
        parser.feed(FALSE_ENCODING.sub(rb"\1", data, count=1))
        root = parser.close()
    except UnreadableTab:
        raise
    except xml.ParseError as error:
        line, column = error.position
        raise UnreadableTab(f"is damaged: line {line}, column {column} of its XML") from None
    except (ValueError, LookupError):  # entities, refused by defusedxml; an unknown encoding
        raise UnreadableTab("its XML declares entities or an unknown encoding, which livebass does not read") from None
    if root.tag.startswith("{"):
        for element in root.iter():
            element.tag = element.tag.rpartition("}")[2]
    return root


def _refuse_long(_: str | None, namespace: str | None) -> None:
    if len(namespace or "") > MAX_NAMESPACE:
        raise UnreadableTab(f"its XML has a namespace of more than {MAX_NAMESPACE} characters")


def _refuse_default(_element: str, _name: str, _kind: str, default: str | None, _required: bool) -> None:
    """Refuses an attribute that each element would get without having it."""
    if default is not None:
        raise UnreadableTab("its XML declares default attributes, which livebass does not read")


@contextmanager
def checked_reading() -> Iterator[None]:
    """Turns what a reader meets in a damaged score into UnreadableTab."""
    try:
        yield
    except UnreadableTab:
        raise
    except (AttributeError, IndexError, KeyError, TypeError, ValueError, ArithmeticError):
        raise UnreadableTab("is damaged: a part of its score is missing or has a wrong value") from None


def number(text: str) -> float:
    """The number in a text. Raises UnreadableTab for a text without a finite number."""
    try:
        found = float(text)
    except ValueError:
        raise _no_number(text, "a number") from None
    if not isfinite(found):
        raise _no_number(text, "finite")
    return found


def whole(text: str | int) -> int:
    """The whole number in a text. Raises UnreadableTab for a text without one, or with thousands of digits."""
    try:
        return int(text)
    except ValueError:
        raise _no_number(str(text), "a whole number") from None


def _no_number(text: str, kind: str) -> UnreadableTab:
    return UnreadableTab(f"is damaged: {shown(text)[:MAX_SHOWN] or 'nothing'} is not {kind}")


@lru_cache(4096)
def exact(text: str) -> Fraction:
    """The number or ratio in a text such as "0.5" or "1/2", to a millionth. Raises UnreadableTab, ZeroDivisionError."""
    above, _, below = text.partition("/")
    return (Fraction(number(above)) / Fraction(number(below or "1"))).limit_denominator(1_000_000)
