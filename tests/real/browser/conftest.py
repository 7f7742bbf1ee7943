"""A browser for the tests of a file; the page in both its forms, made once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.browser import chromium
from support.wasm import PINNED

from livebass import load_preset
from livebass.lab.paper.cases import PRESET
from livebass.web.bench import Source
from livebass.web.export import export_page


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with chromium(tmp_path_factory.mktemp("chromium") / "profile", loggingPrefs={"browser": "ALL"}) as driver:
        yield driver


@pytest.fixture(scope="session")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[bool, Path]:
    """The page's HTML files: in a folder, and (True) in one file."""
    basses = {name: load_preset(name) for name in PINNED}
    return {single: export_page(basses, tmp_path_factory.mktemp("page"), single) for single in (False, True)}


@pytest.fixture(scope="session")
def whole(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The address of a one-file page with everything: benches, a board, and the cases of the paper."""
    basses = {name: load_preset(name) for name in ("jazz-finger", "fretless", "slap", PRESET)}
    folder = tmp_path_factory.mktemp("whole")
    return export_page(basses, folder, True, sources={name: Source(name) for name in basses}).as_uri()
