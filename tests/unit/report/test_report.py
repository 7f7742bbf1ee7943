"""Columns, CSV, JSON, pictures and pages in the form used by every room."""

from __future__ import annotations

import json
import math
import sys

import numpy as np
import pytest
from support.command import python_output

from livebass.report.page import html_page
from livebass.report.picture import check_plots, figure, image
from livebass.report.text import columns, csv_text, json_text, plain, wrapped_columns


def test_columns_are_as_wide_as_their_widest_cell() -> None:
    rows = [("name", "Hz", ""), ("a", "98.0", "x")]
    assert columns(rows) == ["name    Hz   ", "a     98.0  x"]
    assert columns(rows, left=3) == ["name  Hz     ", "a     98.0  x"]


def test_long_cells_are_wrapped_to_their_column() -> None:
    rows = [("a bc", "d"), ("x" * 7, "")]
    assert wrapped_columns(rows, (3, 1)) == ["a    d", "bc", "xxx", "xxx", "x"]


def test_csv_gives_floats_back() -> None:
    text = csv_text(("x", "y"), [(0.1 + 0.2, None), (1, 'a "b", c')])
    assert text == 'x,y\n0.30000000000000004,\n1,"a ""b"", c"\n'


def test_json_has_null_for_what_is_not_finite() -> None:
    assert plain({"a": np.float64("nan"), "b": [np.int64(3), math.inf], 3: (1.5,)}) == {
        "a": None, "b": [3, None], "3": [1.5]
    }  # fmt: skip
    assert (
        json_text({"x": [math.nan, -math.inf, 1.5]}, indent=2) == '{\n  "x": [\n    null,\n    null,\n    1.5\n  ]\n}\n'
    )
    assert json_text("±") == '"\\u00b1"\n' and json_text("±", ascii_only=False) == '"±"\n'
    assert json.loads(json_text({"flag": True, "count": np.int64(2)})) == {"flag": True, "count": 2}


@pytest.mark.parametrize("kind, begins", [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_the_same_figure_is_the_same_file(kind: str, begins: bytes) -> None:
    files = []
    for _ in range(2):
        drawn = figure(3, 2)
        drawn.subplots().plot([1, 2, 3])
        files.append(image(drawn, kind))
    assert files[0] == files[1] and files[0].startswith(begins)


def test_a_page_escapes_what_it_is_given() -> None:
    row = ("<id>", "2", '5 < 6 & "so"', "q", "1", "2", "NO")
    head = ("id", "section", "statement", "quantity", "expected", "measured", "holds")
    text = html_page(
        "livebass.lab.paper", "claims.html", head=head, claims=[row], others=[("set-up", "Set-up", [row])],
        verdict="0 of 1 <hold>", legend={"<term>": "a & b"},
    )  # fmt: skip
    assert "0 of 1 &lt;hold&gt;" in text and "&lt;term&gt;" in text and "a &amp; b" in text
    assert "5 &lt; 6 &amp; &#34;so&#34;" in text and "<id>" not in text and 'class="fails"' in text


def test_without_matplotlib_a_line_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(LookupError, match=r"^--plot needs matplotlib: \S+ .*install .*matplotlib"):
        check_plots("--plot")


def test_importing_the_room_loads_neither_matplotlib_nor_jinja() -> None:
    program = (
        "import sys, livebass.report.text, livebass.report.picture, livebass.report.page, livebass.report.progress; "
        "print({'matplotlib', 'jinja2', 'numba'} & set(sys.modules))"
    )
    assert python_output("-c", program) == "set()\n"
