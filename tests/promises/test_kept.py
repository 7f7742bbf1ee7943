"""Files of earlier versions open, and sound as they did: each folder of tests/kept is of one version."""

from __future__ import annotations

import json
from contextlib import closing

import pytest
from support import kept_files
from support.places import ROOT

from livebass import __version__
from livebass.files.formats import SOUND

KEPT = ROOT / "tests" / "kept"
VERSIONS = sorted(folder.name for folder in KEPT.iterdir() if folder.is_dir())


def test_each_release_has_kept_its_files() -> None:
    """tools/keep.py writes them."""
    assert __version__ in VERSIONS
    for version in VERSIONS:
        names = {file.name for file in (KEPT / version).iterdir()}
        assert {"clap.state", "vst3.state", "lv2.state", "take.mid", "slap.lbass", "link.txt"} <= names, version


def test_another_sound_has_another_number() -> None:
    """The engine's pinned sounds are those of its number: if they change, raise SOUND and run tools/keep.py."""
    assert json.loads((KEPT / kept_files.SOUNDS).read_text("utf-8"))[str(SOUND)] == kept_files.sounds_digest()
    if SOUND > 1:
        assert f"sound {SOUND}" in (ROOT / "CHANGELOG.md").read_text("utf-8").lower()


@pytest.mark.parametrize("version", VERSIONS)
def test_what_a_version_kept_opens_and_sounds_as_it_did(version: str) -> None:
    """Its sounds are compared as long as the engine's sound has the same number."""
    wanted = json.loads((KEPT / version / kept_files.DIGESTS).read_text("utf-8"))
    with closing(kept_files.Opened(KEPT / version)) as opened:
        found = opened.digests()
    assert found["numbers"] == wanted["numbers"]
    if wanted.get("sound", 1) != SOUND:
        return  # the changelog says how this engine sounds otherwise
    for level, sounds in found["sounds"].items():
        if level not in wanted["sounds"]:
            pytest.skip(f"needs a processor of a kind that version {version} kept: {', '.join(wanted['sounds'])}")
        assert sounds == wanted["sounds"][level]
