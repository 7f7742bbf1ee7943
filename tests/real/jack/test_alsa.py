"""MIDI ports on a real ALSA sequencer, which many test machines lack (`modprobe snd-seq`)."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.jack import wait_for
from support.live import OFF, ON, waiting_messages

from livebass.live.midi import MidiPort, port_names
from livebass.live.synth import Synth
from livebass.live.systemmidi import ALSA_CLIENTS
from livebass.live.thread.ring import pop_messages

pytestmark = pytest.mark.skipif(
    not Path("/dev/snd/seq").exists(), reason="there is no ALSA sequencer here: /dev/snd/seq"
)
# Sends a note a millisecond until it is killed
FLOOD = """
import time, supriya_midi as m
out = m.MidiOut(m.RtMidiAPI.LINUX_ALSA, "test-flood")
out.open_virtual_port("out")
while True:
    out.send_message([0x90, 40, 1])
    time.sleep(0.001)
"""


class Keyboard:
    """A virtual output of ALSA's."""

    def __init__(self, name: str) -> None:
        rtmidi = pytest.importorskip("supriya_midi", exc_type=ImportError)
        self.name, self.out = name, rtmidi.MidiOut(rtmidi.RtMidiAPI.LINUX_ALSA, name)
        self.out.open_virtual_port("out")

    def send(self, *messages: list[int]) -> None:
        for message in messages:
            self.out.send_message(message)

    def unplug(self) -> None:
        self.out.close_port()
        self.out.delete()

    @property
    def address(self) -> str:
        return next(name for name in port_names() if name.startswith(f"{self.name}:")).rpartition(" ")[2]


@pytest.fixture
def played() -> Iterator[tuple[Synth, MidiPort]]:
    """A synth and its port, at first a virtual one."""
    pytest.importorskip("supriya_midi", exc_type=ImportError)
    if any("Midi Through" not in name for name in port_names()):
        pytest.skip("there are MIDI devices here, which may play")
    synth = Synth(48000)
    port = MidiPort(synth, None, 64)
    yield synth, port
    port.close()


def virtual_port() -> str:
    """The address of livebass' virtual port."""
    found: list[Any] = [line.split() for line in ALSA_CLIENTS.read_text().splitlines()]
    for k, line in enumerate(found):
        if line[:1] == ["Client"] and '"livebass"' in line and '"livebass"' in found[k + 1]:
            return f"{line[1]}:0"
    raise AssertionError


def connect(*arguments: str) -> None:
    subprocess.run(["aconnect", *arguments], check=True)


def test_a_keyboard_comes_goes_and_returns(played: tuple[Synth, MidiPort]) -> None:
    synth, port = played
    assert port.name == "virtual port livebass" and port.look() is None
    for there in ("there", "back"):
        keyboard = Keyboard("test-keys")
        assert port.look() == f"MIDI: test-keys:out {keyboard.address} is {there}"
        keyboard.send(ON, [0xF0, 1, 2, 0xF7], [0xF8], [0xFE], [0xC0, 3], OFF)
        wait_for(lambda: OFF in waiting_messages(synth))
        assert waiting_messages(synth) == [ON, [0xC0, 3, 0], OFF]
        name = port.name
        keyboard.unplug()
        assert port.look() == f"MIDI: {name} is gone, waiting for it"
        pop_messages(synth.rings[0])


def test_two_keyboards_one_connected_by_hand(played: tuple[Synth, MidiPort]) -> None:
    synth, port = played
    one = Keyboard("test-one")
    assert "test-one" in (port.look() or "")
    two = Keyboard("test-two")
    connect(two.address, virtual_port())
    assert port.look() is None
    for key in range(100):
        one.send([0x90, key, 1])
        two.send([0x90, key, 2])
    wait_for(lambda: len(waiting_messages(synth)) == 200)
    for velocity in (1, 2):
        assert [key for _, key, v in waiting_messages(synth) if v == velocity] == list(range(100))
    pop_messages(synth.rings[0])
    connect(one.address, virtual_port())
    assert "connected to the virtual port" in (port.look() or "")
    one.send(ON, OFF)
    wait_for(lambda: OFF in waiting_messages(synth))
    assert waiting_messages(synth) == [ON, OFF], "once"
    connect("-d", one.address, virtual_port())
    assert "test-one" in (port.look() or "")
    one.unplug()
    two.unplug()


def test_a_port_closes_while_messages_come() -> None:
    flood = subprocess.Popen([sys.executable, "-c", FLOOD])
    try:
        wait_for(lambda: any(name.startswith("test-flood") for name in port_names()), process=None)
        for _ in range(20):
            synth = Synth(48000)
            port = MidiPort(synth, "test-flood", 64)
            wait_for(lambda synth=synth: waiting_messages(synth))  # type: ignore[misc]
            port.close()
    finally:
        flood.kill()
        flood.wait()
