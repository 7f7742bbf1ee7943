"""Structures and functions of C for hosts by ctypes."""

from __future__ import annotations

import ctypes as c
from typing import Any

function = c.CFUNCTYPE


def struct(**fields: Any) -> Any:
    """A structure with these fields, in order."""
    return type("Struct", (c.Structure,), {"_fields_": list(fields.items())})
