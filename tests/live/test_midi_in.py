"""MIDI ports by python-rtmidi, here those of the JACK server: a test machine has no MIDI of its own."""

from __future__ import annotations

import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import soundfile
from support.jack import livebass, wait_for

from livebass.live.inputs import THROUGH, MidiLost, MidiPort, bare, find_port, port_names
from livebass.live.synth import Synth
from livebass.live.thread.ring import unread

ON, OFF = [0x90, 40, 100], [0x80, 40, 0]


class Source:
    """A MIDI device: a virtual output of rtmidi."""

    def __init__(self, name: str = "test-keys") -> None:
        import rtmidi

        self.out = rtmidi.MidiOut(rtapi=rtmidi.API_UNIX_JACK, name=name)
        self.out.open_virtual_port("out")
        wait_for(lambda: any(name in port for port in port_names()))

    def send(self, *messages: list[int]) -> None:
        for message in messages:
            self.out.send_message(message)

    def unplug(self) -> None:
        if self.out is not None:
            self.out.close_port()
            self.out.delete()
            self.out = None


@pytest.fixture
def source(server: SimpleNamespace) -> Iterator[Source]:
    pytest.importorskip("rtmidi")
    made = Source()
    yield made
    made.unplug()


def arrived(synth: Synth) -> list[list[int]]:
    """The messages that wait in the synth's first ring."""
    return [message for _, *message in unread(synth.rings[0])]


def test_notes_arrive(source: Source) -> None:
    synth = Synth(48000)
    port = MidiPort(synth, "test-KEYS", 64)
    try:
        assert "test-keys" in port.name
        source.send(ON, [0xF0, 1, 2, 0xF7], [0xF8], [0xC0, 3], OFF)
        wait_for(lambda: OFF in arrived(synth))
        # a server that waits in vain for a client hands over again what it had from it
        heard = [m for m, before in zip(arrived(synth), [None, *arrived(synth)], strict=False) if m != before]
        assert heard == [ON, [0xC0, 3, 0], OFF]
    finally:
        port.close()
        port.close()


def test_unplugged_and_plugged_again(source: Source) -> None:
    synth = Synth(48000)
    port = MidiPort(synth, None, 64)
    again = None
    try:
        assert port.look() is None
        name = port.name
        source.unplug()
        wait_for(lambda: not port_names())
        assert port.look() == f"MIDI: {name} is gone, waiting for it"
        ended = [[0xB0 | channel, 123, 0] for channel in range(16)]
        assert all(message in arrived(synth) for message in ended), "keys that were held"
        assert port.look() is None
        again = Source()
        assert port.look() == f"MIDI: {name} is back"
        count = len(arrived(synth))
        again.send(ON)
        wait_for(lambda: len(arrived(synth)) > count)
        assert arrived(synth)[-1] == ON
    finally:
        port.close()
        if again:
            again.unplug()


def test_without_a_device_there_is_a_virtual_port_until_one_comes(server: SimpleNamespace) -> None:
    pytest.importorskip("rtmidi")
    synth = Synth(48000)
    port = MidiPort(synth, None, 64)
    source = None
    try:
        assert port.name == "virtual port livebass"
        client = server.jack.Client("probe", no_start_server=True)
        names = [p.name for p in client.get_ports(is_midi=True, is_input=True)]
        client.close()
        assert any(name.startswith("livebass") and name.endswith(":livebass") for name in names)
        source = Source()
        assert "test-keys" in (port.look() or "") and "test-keys" in port.name
        source.send(ON)
        wait_for(lambda: arrived(synth))
        assert all(message == ON for message in arrived(synth))
    finally:
        port.close()
        if source:
            source.unplug()


def test_a_port_that_is_not_there_is_named(source: Source) -> None:
    for wanted in ("nix", "17"):
        with pytest.raises(MidiLost, match=f"'{wanted}': not found; there is .*test-keys"):
            MidiPort(Synth(48000), wanted, 64)


@pytest.mark.parametrize("extra", [("--backend", "portaudio", "--midi", "test-keys"), ("--midi", "test-keys")])
def test_the_whole_program(source: Source, tmp_path: Path, extra: tuple[str, ...]) -> None:
    """A MIDI source plays livebass, by rtmidi or straight into its JACK port; the sound is in the take."""
    take, log = tmp_path / "take.wav", tmp_path / "log.txt"
    process = livebass("play", "-p", "slap", "--record", take, "--log", log, *extra)
    again = None
    try:
        wait_for(lambda: log.exists() and "playing" in log.read_text())
        time.sleep(0.3)
        source.send(ON)
        time.sleep(0.5)
        source.send(OFF)
        time.sleep(0.3)
        source.unplug()
        wait_for(lambda: "is gone" in log.read_text())
        again = Source()
        wait_for(lambda: f"test-keys:out is {'back' if 'portaudio' in extra else 'there'}" in log.read_text())
        again.send(ON, OFF)
        time.sleep(0.3)
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate(timeout=20)
    finally:
        process.kill()
        if again:
            again.unplug()
    assert process.returncode == 0, err
    count = re.search(r"(\d+) messages", err)
    assert count and int(count[1]) >= 36, "two notes, and 16 channels let go"
    assert np.abs(soundfile.read(take)[0]).max() > 0.05


def test_names_and_numbers() -> None:
    names = [f"{THROUGH}:{THROUGH} Port-0 14:0", "Keystation:MIDI 1 24:0", "Launchkey:MIDI 1 28:0"]
    chosen: list[tuple[Any, Any]] = [
        (None, 1), ("0", 0), ("2", 2), ("3", None), ("launch", 2), ("midi 1", 1), ("nix", None),
    ]  # fmt: skip
    assert [find_port(names, wanted) for wanted, _ in chosen] == [index for _, index in chosen]
    assert find_port(names[:1], None) is None
    assert bare(names[1]) == bare("Keystation:MIDI 1 32:0") != bare(names[2])
