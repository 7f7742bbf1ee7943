"""MIDI ports of a JACK server: notes of a source, ports that go and come, connections by hand."""

from __future__ import annotations

import contextlib
import json
import re
import signal
import subprocess
import sys
import time
from itertools import groupby
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import soundfile
from support.fakejack import RATE
from support.jack import PATIENCE, end, playing, wait_for, wait_for_log, wait_for_take
from support.live import OFF, ON, waiting_messages

from livebass.lab.bench.jack import new_client
from livebass.live.device_errors import MidiLost
from livebass.live.midi import MidiPort, port_names
from livebass.live.synth import Synth

SOURCE = """
import collections, json, sys, time
from livebass.lab.bench.jack import new_client

client = new_client(sys.argv[1])
port = client.midi_outports.register("out")
queue = collections.deque()  # the messages of each next period

def process(frames):
    port.clear_buffer()
    for offset, message in enumerate(queue.popleft() if queue else []):
        port.write_midi_event(offset, message)

client.set_process_callback(process)
client.activate()
print("ready", flush=True)
for line in sys.stdin:
    queue.append(json.loads(line))
    while queue:
        time.sleep(0.001)
    print("sent", flush=True)
"""


class Source:
    """A MIDI device: a client of the JACK server, with an output.

    It is a process of its own, as JACK's library cancels the thread of a client that is deactivated, and a thread that
    is cancelled within a callback in Python keeps Python's lock for ever.
    """

    def __init__(self, name: str = "test-keys") -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", SOURCE, name], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        self._expect("ready")

    def _expect(self, word: str) -> None:
        assert self.process.stdout and self.process.stdout.readline().strip() == word

    def send(self, *messages: list[int]) -> None:
        """Sends messages, all in one period."""
        assert self.process.stdin
        print(json.dumps(messages), file=self.process.stdin, flush=True)
        self._expect("sent")

    def reach(self, synth: Synth, message: list[int]) -> None:
        """Sends `message` until it arrives: a server drops input during the cycle that connects two ports."""
        before = len(waiting_messages(synth))
        for _ in range(20):
            self.send(message)
            with contextlib.suppress(AssertionError):
                return wait_for(lambda: len(waiting_messages(synth)) > before, PATIENCE / 20)
        raise AssertionError("waited in vain")

    def close(self) -> None:
        """Unplugs it."""
        self.process.kill()
        self.process.communicate()


@pytest.fixture
def source(server: SimpleNamespace, lend: Any) -> Source:
    return lend(Source())  # type: ignore[no-any-return]


def test_notes_arrive(source: Source, lend: Any) -> None:
    synth = Synth(48000)
    port = lend(MidiPort(synth, "test-KEYS", 64))
    assert "test-keys" in port.name
    source.reach(synth, ON)
    source.send([0xF0, 1, 2, 0xF7], [0xF8], [0xC0, 3], OFF)
    wait_for(lambda: OFF in waiting_messages(synth))
    # a server that waits in vain for a client repeats that client's last data
    assert [m for m, _ in groupby(waiting_messages(synth))] == [ON, [0xC0, 3, 0], OFF]
    port.close()  # and once more, after the test


def test_unplugged_and_plugged_again(source: Source, lend: Any) -> None:
    synth = Synth(48000)
    port = lend(MidiPort(synth, None, 64))
    assert port.look() is None
    name = port.name
    source.close()
    wait_for(lambda: not port_names())
    assert port.look() == f"MIDI: {name} is gone, waiting for it"
    ended = [[0xB0 | channel, 123, 0] for channel in range(16)]
    assert all(message in waiting_messages(synth) for message in ended), "keys that were held"
    assert port.look() is None
    again = lend(Source())
    assert port.look() == f"MIDI: {name} is back"
    again.reach(synth, ON)
    assert waiting_messages(synth)[-1] == ON


def test_without_a_device_there_is_a_virtual_port_until_one_comes(server: SimpleNamespace, lend: Any) -> None:
    synth = Synth(48000)
    port = lend(MidiPort(synth, None, 64))
    assert port.name == "virtual port livebass"
    client = new_client("probe")
    names = [p.name for p in client.get_ports(is_midi=True, is_input=True)]
    client.close()
    assert any(name.startswith("livebass") and name.endswith(":livebass") for name in names)
    source = lend(Source())
    assert "test-keys" in (port.look() or "") and "test-keys" in port.name
    source.reach(synth, ON)
    assert all(message == ON for message in waiting_messages(synth))


@pytest.mark.parametrize("first", ["by hand", "by livebass"])
def test_a_source_connected_by_hand_is_heard_once(server: SimpleNamespace, lend: Any, first: str) -> None:
    """It is connected to the virtual port before or after livebass opens it."""
    synth = Synth(48000)
    port, client, source = lend(MidiPort(synth, None, 64)), lend(new_client("patchbay")), lend(Source())
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
        before = len(waiting_messages(synth))
        source.send(ON, OFF)
        wait_for(lambda before=before: OFF in waiting_messages(synth)[before:])  # type: ignore[misc]
        time.sleep(0.2)
        heard = waiting_messages(synth)[before:]
        if heard == [ON, OFF]:
            break
    assert heard == [ON, OFF]
    client.disconnect(theirs, ours)
    wait_for(lambda: not port._ports.by_hand())
    assert "test-keys" in (port.look() or ""), "free again"


def test_jack_needs_no_other_library(source: Source, monkeypatch: pytest.MonkeyPatch, lend: Any) -> None:
    monkeypatch.setitem(sys.modules, "supriya_midi", None)
    synth = Synth(RATE)
    assert lend(MidiPort(synth, None, 64)).name == "test-keys:out"
    source.reach(synth, ON)
    assert all(message == ON for message in waiting_messages(synth))


def test_a_port_that_is_not_there_is_named(source: Source) -> None:
    for wanted in ("nix", "17"):
        with pytest.raises(MidiLost, match=f"'{wanted}': not found; there is .*test-keys"):
            MidiPort(Synth(48000), wanted, 64)


@pytest.mark.parametrize(
    "extra", [("--backend", "portaudio", "--midi", "test-keys"), ("--midi", "test-keys"), ("--midi", "0")]
)
def test_the_whole_program(source: Source, lend: Any, tmp_path: Path, extra: tuple[str, ...]) -> None:
    """A MIDI source plays livebass, beside or straight into its JACK client; the sound lands in the take."""
    take, log = tmp_path / "take.wav", tmp_path / "log.txt"
    with playing("-p", "slap", "--record", take, "--log", log, *extra) as process:
        wait_for_log(log, "playing", process=process)
        play(source, take)
        source.close()
        wait_for_log(log, "is gone", process=process)
        again = lend(Source())
        there = f"test-keys:out is {'back' if 'portaudio' in extra else 'there'}"
        wait_for_log(log, there, process=process)
        play(again, take)
        err = end(process, signal.SIGTERM)
    assert process.returncode == 0, err
    count = re.search(r"(\d+) messages", err)
    assert count and int(count[1]) >= 36, "two notes, and 16 channels let go"
    assert np.abs(soundfile.read(take)[0]).max() > 0.05


def play(source: Source, take: Path) -> None:
    """Plays a note three times while recording, as a busy machine's server may lose one."""
    for message in (ON, OFF) * 3:
        source.send(message)
        wait_for_take(take, 0.3, more=True)
