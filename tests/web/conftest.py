"""The page in both its forms, made once."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.wasm import PINNED

from livebass import load_preset
from livebass.web.export import export_page


@pytest.fixture(scope="session")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[bool, Path]:
    """The HTML files of the page in a folder, and (True) in one file."""
    basses = {name: load_preset(name) for name in PINNED}
    return {single: export_page(basses, tmp_path_factory.mktemp("page"), single) for single in (False, True)}
