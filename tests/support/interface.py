"""The public interface as text: the names, signatures and members that later versions keep (docs/versions.md)."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any, ForwardRef

import livebass
from livebass.engine.engine import Playing

HEAD = "The public interface of livebass. tools/keep.py --api writes this file; what it lists stays (docs/versions.md)."
UNPACKED = re.compile(r"Unpack\[(\w+)\]")


def public_lines() -> str:
    """Each public name with its signature, and under a class its public members."""
    lines = [HEAD, ""]
    for name in livebass.__all__:
        found = getattr(livebass, name)
        if inspect.isclass(found):
            lines += [f"class {name}{constructor(found)}", *(f"    {line}" for line in members(found))]
        elif inspect.isfunction(found):
            lines.append(f"def {name}{signature(found)}")
        else:
            lines.append(f"{name}: {type(found).__name__} of {', '.join(map(str, found))}")
    return "\n".join(lines) + "\n"


def constructor(kind: type) -> str:
    """How to call a class; its base for an exception."""
    if issubclass(kind, BaseException):
        return f"({next(base.__name__ for base in kind.__mro__[1:] if base.__module__ == 'builtins')})"
    return signature(kind)


def members(kind: type) -> Iterator[str]:
    """The public fields, properties and methods of a class, in order of name; of an engine, those of `Playing`."""
    bases = [Playing] if issubclass(kind, Playing) else [b for b in kind.__mro__ if b.__module__.startswith("livebass")]
    hints = {name: hint for base in reversed(bases) for name, hint in inspect.get_annotations(base).items()}
    for name in sorted({name for base in bases for name in vars(base)} | set(hints)):
        if name.startswith("_"):
            continue
        found = inspect.getattr_static(kind, name, None)
        if isinstance(found, property | cached_property):
            getter = found.fget if isinstance(found, property) else found.func
            yield f"{name}: {inspect.signature(getter or name).return_annotation}"
        elif inspect.isroutine(found):
            yield f"def {name}{signature(getattr(kind, name))}"
        else:
            yield f"{name}: {hints.get(name, type(found).__name__)}"


def signature(call: Callable[..., Any]) -> str:
    """A signature with the keywords that a TypedDict lists; a default without a text of its own is three points."""
    found = inspect.signature(call)
    shown, more = [], ""
    for one in found.parameters.values():
        if one.default is not one.empty:
            one = one.replace(default=Shown(repr(one.default)))
        if one.annotation is not one.empty:
            one = one.replace(annotation=Shown(one.annotation))
        if listing := UNPACKED.fullmatch(repr(one.annotation)):
            keys = inspect.getmodule(call).__dict__[listing[1]].__annotations__
            more = f"; {listing[1]}: {', '.join(f'{key}: {text(hint)}' for key, hint in keys.items())}"
        shown.append(one)
    result = "" if found.return_annotation is found.empty else found.return_annotation
    return (
        str(found.replace(parameters=shown, return_annotation=found.empty)) + (f" -> {result}" if result else "") + more
    )


def text(hint: Any) -> str:
    """An annotation as it was written."""
    return hint.__forward_arg__ if isinstance(hint, ForwardRef) else str(hint)


class Shown:
    """A default value or an annotation as the list shows it."""

    def __init__(self, shown: str) -> None:
        self.shown = "..." if " at 0x" in shown or shown == "<factory>" else shown

    def __repr__(self) -> str:
        return self.shown
