"""No function has too many parameters for a readable call."""

from __future__ import annotations

import ast

from support.places import ROOT

PACKAGE = ROOT / "livebass"
MAXIMUM = 8


def test_functions_have_at_most_eight_parameters() -> None:
    found = set()
    for file in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                given = node.args
                if len(given.posonlyargs) + len(given.args) + len(given.kwonlyargs) > MAXIMUM:
                    found.add(f"{file.relative_to(PACKAGE).as_posix()}: {node.name}")
    assert not found
