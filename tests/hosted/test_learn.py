"""Controllers that the plugin learns: by a window's request, in C, and in the states of hosts."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest
from support.clap import Plugin, midi, note_on
from support.plugins import c_host
from support.states import with_learned

from livebass.live.parameters import PARAMETERS
from livebass.plugin.systems import this_system
from livebass.rows.techniques import PARAMETER_ROWS

TONE, BASS = PARAMETER_ROWS["tone"].number, PARAMETER_ROWS["bass"].number
BASSES = ("slap",)


@pytest.mark.skipif(this_system().ending != "so", reason="a host on Linux")
def test_the_next_controller_is_learned(folder: Path, tmp_path: Path) -> None:
    assert subprocess.run([c_host(tmp_path, "learnhost"), folder], timeout=60).returncode == 0


def test_a_session_keeps_what_was_learned(plugin: Plugin) -> None:
    plain = plugin.save()
    state = with_learned(plain, {20: TONE, 7: 0})
    assert plugin.load(state) and plugin.save() == state
    silent = plugin.block(4000, [midi(bytes([0xB0, 20, 127])), midi(bytes([0xB5, 7, 0])), note_on(40, 0.8)])
    assert plugin.value(TONE) == 1 and plugin.value(0) == PARAMETERS[0].minimum and abs(silent[500:]).max() == 0
    assert sorted(plugin.reported) == [(0, PARAMETERS[0].minimum), (TONE, 1.0)]
    assert not plugin.load(state[:120] + b"?" + state[121:])
    assert plugin.load(plain) and plugin.save() == plain
    plugin.block(64, [midi(bytes([0xB0, 20, 0]))])
    assert plugin.value(TONE) == 0 and np.isfinite(plugin.block(64)).all()
