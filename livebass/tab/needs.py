"""The packages of the extra `tab`, and XML by them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from livebass.extras import install
from livebass.tab.model import UnreadableTab

PACKAGES = {"guitarpro": "Guitar Pro 3 to 5 files need PyGuitarPro", "defusedxml.ElementTree": "XML needs defusedxml"}


def needed(module: str) -> Any:
    """A module of PACKAGES. Raises LookupError with the command that installs it."""
    try:
        return import_module(module)
    except ImportError:
        raise LookupError(f"{PACKAGES[module]}: {install('tab')}") from None


def parsed_xml(data: bytes) -> Any:
    """The root of an XML document. Raises UnreadableTab for damage and entities, and LookupError without defusedxml."""
    xml = needed("defusedxml.ElementTree")
    try:
        return xml.fromstring(data)
    except xml.ParseError as error:
        line, column = error.position
        raise UnreadableTab(f"is damaged: line {line}, column {column} of its XML") from None
    except (ValueError, LookupError):  # entities, refused by defusedxml; an unknown encoding
        raise UnreadableTab("its XML declares entities or an unknown encoding, which livebass does not read") from None
