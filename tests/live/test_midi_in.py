"""MIDI ports: of the JACK server, and of a system made for the test, as a test machine has no MIDI of its own."""

from __future__ import annotations

import contextlib
import re
import signal
import time
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import soundfile
from support.jack import PATIENCE, livebass, wait_for, wait_for_log, wait_for_take

from livebass.bench.jack import new_client
from livebass.live.lost import MidiLost
from livebass.live.midi import THROUGH, MidiPort, bare, find_port, port_names
from livebass.live.synth import Synth
from livebass.live.systemmidi import alsa_sources, is_message
from livebass.live.thread.ring import unread

ON, OFF = [0x90, 40, 100], [0x80, 40, 0]


class Source:
    """A MIDI device: a client of the JACK server, with an output."""

    def __init__(self, name: str = "test-keys") -> None:
        self.client = new_client(name)
        self.port = self.client.midi_outports.register("out")
        self.queue: deque[list[list[int]]] = deque()  # the messages of each next period
        self.client.set_process_callback(self._process)
        self.client.activate()

    def _process(self, _frames: int) -> None:
        self.port.clear_buffer()
        for offset, message in enumerate(self.queue.popleft() if self.queue else []):
            self.port.write_midi_event(offset, message)

    def send(self, *messages: list[int]) -> None:
        """Sends messages, all in one period."""
        self.queue.append(list(messages))
        wait_for(lambda: not self.queue)

    def reach(self, synth: Synth, message: list[int]) -> None:
        """Sends `message` until it arrives: a server drops input during the cycle that connects two ports."""
        before = len(arrived(synth))
        for _ in range(20):
            self.send(message)
            with contextlib.suppress(AssertionError):
                return wait_for(lambda: len(arrived(synth)) > before, PATIENCE / 20)
        raise AssertionError("waited in vain")

    def unplug(self) -> None:
        if self.client is not None:
            self.client.deactivate()
            self.client.close()
            self.client = None


@pytest.fixture
def source(server: SimpleNamespace) -> Iterator[Source]:
    made = Source()
    yield made
    made.unplug()


def arrived(synth: Synth) -> list[list[int]]:
    """The messages waiting in the synth's rings of Python and JACK."""
    return [message for ring in (0, 2) for _, *message in unread(synth.rings[ring])]


def test_notes_arrive(source: Source) -> None:
    synth = Synth(48000)
    port = MidiPort(synth, "test-KEYS", 64)
    try:
        assert "test-keys" in port.name
        source.reach(synth, ON)
        source.send([0xF0, 1, 2, 0xF7], [0xF8], [0xC0, 3], OFF)
        wait_for(lambda: OFF in arrived(synth))
        # a server that waits in vain for a client repeats that client's last data
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
        again.reach(synth, ON)
        assert arrived(synth)[-1] == ON
    finally:
        port.close()
        if again:
            again.unplug()


def test_without_a_device_there_is_a_virtual_port_until_one_comes(server: SimpleNamespace) -> None:
    synth = Synth(48000)
    port = MidiPort(synth, None, 64)
    source = None
    try:
        assert port.name == "virtual port livebass"
        client = new_client("probe")
        names = [p.name for p in client.get_ports(is_midi=True, is_input=True)]
        client.close()
        assert any(name.startswith("livebass") and name.endswith(":livebass") for name in names)
        source = Source()
        assert "test-keys" in (port.look() or "") and "test-keys" in port.name
        source.reach(synth, ON)
        assert all(message == ON for message in arrived(synth))
    finally:
        port.close()
        if source:
            source.unplug()


@pytest.mark.parametrize("first", ["by hand", "by livebass"])
def test_a_source_connected_by_hand_is_heard_once(server: SimpleNamespace, first: str) -> None:
    """It is connected to the virtual port before or after livebass opens it."""
    synth = Synth(48000)
    port = MidiPort(synth, None, 64)
    source = None
    client = new_client("patchbay")
    try:
        source = Source()
        if first == "by livebass":
            assert "test-keys" in (port.look() or "")
        ours = client.get_ports("^livebass[^:]*:livebass$", is_midi=True, is_input=True)[0]
        theirs = client.get_ports("test-keys", is_midi=True, is_output=True)[0]
        client.connect(theirs, ours)
        wait_for(port._ports.by_hand)
        said = port.look() or ""
        assert ("connected to the virtual port" in said) == (first == "by livebass")
        assert port.look() is None and port.name == "virtual port livebass"
        heard: list[list[int]] = []
        for _ in range(20):  # a server that waits in vain for a client repeats that client's last data
            before = len(arrived(synth))
            source.send(ON, OFF)
            wait_for(lambda before=before: OFF in arrived(synth)[before:])  # type: ignore[misc]
            time.sleep(0.2)
            heard = arrived(synth)[before:]
            if heard == [ON, OFF]:
                break
        assert heard == [ON, OFF]
        client.disconnect(theirs, ours)
        wait_for(lambda: not port._ports.by_hand())
        assert "test-keys" in (port.look() or ""), "free again"
    finally:
        client.close()
        port.close()
        if source:
            source.unplug()


ALSA = """Client info
  cur  clients : 3

Client  14 : "Midi Through" [Kernel]
  Port   0 : "Midi Through Port-0" (RWe-)
    Connected From: 24:0
Client  24 : "Keystation" [Kernel]
  Port   0 : "Keystation MIDI 1" (RWeX)
    Connecting To: 128:0, 14:0
Client 128 : "livebass" [User]
  Port   0 : "livebass" (-We-)
    Connected From: 24:0, 28:1
Client 129 : "livebass" [User]
  Port   0 : "in" (-We-)
    Connected From: 32:0
"""


def test_what_alsa_shows_of_connections() -> None:
    assert alsa_sources(ALSA) == {"24:0", "28:1"}
    assert not alsa_sources("")


def test_whole_messages_only() -> None:
    whole = [ON, OFF, [0xC0, 3], [0xD1, 3], [0xE0, 0, 127], [0x9F, 127, 0]]
    broken = [[], [0x90], [0x90, 40], [0x90, 40, 100, 1], [0xC0], [0xC0, 3, 0], [0x90, 200, 1], [0x40, 1, 2], [0xF8]]
    assert all(map(is_message, whole)) and not any(map(is_message, broken))


def test_a_port_that_is_not_there_is_named(source: Source) -> None:
    for wanted in ("nix", "17"):
        with pytest.raises(MidiLost, match=f"'{wanted}': not found; there is .*test-keys"):
            MidiPort(Synth(48000), wanted, 64)


@pytest.mark.parametrize("extra", [("--backend", "portaudio", "--midi", "test-keys"), ("--midi", "test-keys")])
def test_the_whole_program(source: Source, tmp_path: Path, extra: tuple[str, ...]) -> None:
    """A MIDI source plays livebass, by rtmidi or straight into its JACK port; the sound lands in the take."""
    take, log = tmp_path / "take.wav", tmp_path / "log.txt"
    process = livebass("play", "-p", "slap", "--record", take, "--log", log, *extra)
    again = None
    try:
        wait_for_log(log, "playing", process=process)
        play(source, take)
        source.unplug()
        wait_for_log(log, "is gone", process=process)
        again = Source()
        there = f"test-keys:out is {'back' if 'portaudio' in extra else 'there'}"
        wait_for_log(log, there, process=process)
        play(again, take)
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
        if again:
            again.unplug()
    assert process.returncode == 0, err
    count = re.search(r"(\d+) messages", err)
    assert count and int(count[1]) >= 36, "two notes, and 16 channels let go"
    assert np.abs(soundfile.read(take)[0]).max() > 0.05


def play(source: Source, take: Path) -> None:
    """Plays a note three times while recording, as a busy machine's server may lose one."""
    for message in (ON, OFF) * 3:
        source.send(message)
        wait_for_take(take, 0.3, more=True)


def test_names_and_numbers() -> None:
    names = [f"{THROUGH}:{THROUGH} Port-0 14:0", "Keystation:MIDI 1 24:0", "Launchkey:MIDI 1 28:0"]
    chosen: list[tuple[Any, Any]] = [
        (None, 1), ("0", 0), ("2", 2), ("3", None), ("launch", 2), ("midi 1", 1), ("nix", None),
    ]  # fmt: skip
    assert [find_port(names, wanted) for wanted, _ in chosen] == [index for _, index in chosen]
    assert find_port(names[:1], None) is None
    assert bare(names[1]) == bare("Keystation:MIDI 1 32:0") != bare(names[2])
