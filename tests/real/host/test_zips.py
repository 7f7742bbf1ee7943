"""A producer's first ten minutes with the archive of this system."""

from __future__ import annotations

import io
import re
import shutil
import sys
import zipfile
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.archives import archive
from support.clap import Library, Plugin, midi, note_on, value
from support.jack import wait_for
from support.plugins import hard_score, mono
from support.screen import needs_screen, running_screen
from support.window import Window, different

from livebass.plugin.build import binary
from livebass.plugin.systems import this_system
from livebass.rows.arrays import Floats
from livebass.rows.techniques import SLIDER_ROWS


@pytest.mark.skipif(sys.platform != "linux", reason="this system's archive is unpacked on Linux")
def test_a_producers_first_ten_minutes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Unpack, copy as the text says, find, load, look, play, change the action, save, load, automate, bounce."""
    needs_screen()
    name, home = this_system().name, tmp_path / "home"
    data, score = archive(name, {name: binary(this_system())}), hard_score(notes=2)
    sound = mono("slap", score)
    monkeypatch.setenv("HOME", str(home))
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        packed.extractall(home / "Downloads")
    (unpacked,) = (home / "Downloads").iterdir()
    said = re.search(r"(CLAP/[\w-]+) into ([^\s,]+)", (unpacked / "INSTALL.txt").read_text())
    assert said
    where = Path(said[2]).expanduser()
    shutil.copytree(unpacked / said[1], where / Path(said[1]).name)
    shutil.rmtree(unpacked)

    (found,) = [path for path in (home / ".clap").rglob("*.clap") if path.is_file()]
    assert [key for key, *_ in Library(found.parent).presets()] == ["Slap", "Bright slap", "Scooped slap", "Slap funk"]
    action = SLIDER_ROWS["action"].parameter.number
    with closing(Plugin(found.parent)) as plugin:
        assert np.array_equal(plugin.play(score, len(sound)), sound), "what `render` makes"
        with running_screen(), closing(Window(plugin)) as window:
            rest = window.picture()
            plugin.block(512, [note_on(28, 1.0)])
            wait_for(lambda: different(window.picture(), rest) > 200)
        plugin.set(action, -0.8)
        state = plugin.save()

    def bounce(events: list[tuple[int, Any]]) -> Floats:
        with closing(Plugin(found.parent, active=False)) as again:
            assert again.load(state) and again.value(action) == -0.8
            again.offline()
            again.activate()
            return again.play(events, len(sound))

    third = len(sound) // 3 // 512 * 512  # between two blocks
    played = [(int(f), midi(m.tobytes())) for f, m in zip(score.frames, score.messages, strict=True)]
    automated = sorted([*played, (third, value(action, 0.5))], key=lambda event: event[0])
    lowered, moved, again = bounce(played), bounce(automated), bounce(automated)
    assert np.array_equal(moved, again)
    assert 0.05 * np.abs(sound).max() < np.abs(lowered - sound).max()
    assert np.array_equal(moved[:third], lowered[:third]) and not np.array_equal(moved[third:], lowered[third:])
    assert sorted(path.name for path in home.iterdir()) == [".clap", "Downloads"], "nothing else is left"
