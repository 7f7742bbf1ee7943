"""The LV2 plugin in jalv.gtk3, a third-party host, between a JACK server and a screen."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.jack import wait_for
from support.needs import tool
from support.plugins import no_instruments_of_the_user, write_bundle  # noqa: F401
from support.screen import LOWEST_STRING, hand, needs_screen, running_screen

from livebass.lab.bench.jack import MidiProbe, end_process, new_client
from livebass.plugin import lv2
from livebass.plugin.systems import this_system

pytestmark = pytest.mark.skipif(not this_system().name.startswith("linux"), reason="windows of X11")
HOST = "jalv-test"
LOUD = 0.05


def test_it_plays_by_midi_and_by_a_hand_in_its_window(server: SimpleNamespace, tmp_path: Path) -> None:
    needs_screen()
    tool("jalv.gtk3", "LV2")
    bundles = write_bundle(lv2, tmp_path / "livebass.lv2").parent
    ears, peaks, midi = new_client("ears"), [0.0], MidiProbe()
    heard = ears.inports.register("in")
    ears.set_process_callback(lambda _: peaks.append(float(np.abs(heard.get_array()).max())))

    def connected() -> bool:
        """Connects the host, once it runs and has its ports."""
        sound, notes = (ears.get_ports(f"{HOST}:", **{kind: True}) for kind in ("is_audio", "is_midi"))
        try:
            if not heard.connections:
                ears.connect(sound[0], heard)
            midi.client.connect(midi.port, notes[0])
        except (IndexError, server.jack.JackError):
            return False
        return True

    with running_screen() as screen:
        host = subprocess.Popen(
            ["jalv.gtk3", "-n", HOST, "urn:livebass:bass"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env=os.environ | {"LV2_PATH": str(bundles), "HOME": str(tmp_path), "DISPLAY": screen},
        )  # fmt: skip
        try:
            ears.activate()
            midi.client.activate()
            wait_for(lambda: host.poll() is not None or connected())
            assert host.poll() is None

            def sounds(again: Any) -> bool:
                """Repeats it, and tells if it is heard: freshly connected ports lose their input."""
                again()
                time.sleep(0.3)
                return max(peaks[-100:]) > LOUD

            wait_for(lambda: sounds(lambda: midi.send(5, 0x90, 33, 110)))
            midi.send(5, 0xB0, 120, 0)
            wait_for(lambda: max(peaks[-100:]) < 1e-6)
            wait_for(lambda: sounds(lambda: hand("mouseup", 1, "mousemove", *LOWEST_STRING, "mousedown", 1)))
            assert host.poll() is None
        finally:
            midi.close()
            ears.deactivate(ignore_errors=True)
            ears.close(ignore_errors=True)
            end_process(host, 10)
            host.wait()
    assert host.returncode == 0
