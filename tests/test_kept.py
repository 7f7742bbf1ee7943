"""Files of earlier versions open, and sound as they did: each folder of tests/kept is of one version."""

from __future__ import annotations

import json
from contextlib import closing
from pathlib import Path

import pytest
from support import kept_files

from livebass import __version__

KEPT = Path(__file__).parent / "kept"
VERSIONS = sorted(folder.name for folder in KEPT.iterdir() if folder.is_dir())


def test_each_release_has_kept_its_files() -> None:
    """tools/keep.py writes them."""
    assert __version__ in VERSIONS
    for version in VERSIONS:
        names = {file.name for file in (KEPT / version).iterdir()}
        assert {"clap.state", "vst3.state", "lv2.state", "take.mid", "slap.lbass", "link.txt"} <= names, version


@pytest.mark.parametrize("version", VERSIONS)
def test_what_a_version_kept_opens_and_sounds_as_it_did(version: str) -> None:
    wanted = json.loads((KEPT / version / kept_files.DIGESTS).read_text("utf-8"))
    with closing(kept_files.Opened(KEPT / version)) as opened:
        found = opened.digests()
    assert found["numbers"] == wanted["numbers"]
    for level, sounds in found["sounds"].items():
        if level not in wanted["sounds"]:
            pytest.skip(f"needs a processor of a kind that version {version} kept: {', '.join(wanted['sounds'])}")
        assert sounds == wanted["sounds"][level]
