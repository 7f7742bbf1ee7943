"""MIDI ports: of the JACK server, and of a system made for the test, as a test machine has no MIDI of its own."""

from __future__ import annotations

import contextlib
import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import soundfile
from support.fakejack import RATE, Server, fake_jack
from support.jack import PATIENCE, livebass, wait_for, wait_for_log, wait_for_take

from livebass.bench.jack import new_client
from livebass.extras import install
from livebass.live import systemmidi
from livebass.live.desk import Desk
from livebass.live.jackmidi import JackMidi
from livebass.live.lost import MidiLost, NoMidi
from livebass.live.midi import THROUGH, MidiPort, bare, find_port, port_names
from livebass.live.synth import Synth
from livebass.live.systemmidi import SystemMidi, alsa_connections, alsa_sources, is_message
from livebass.live.thread.ring import NOW, pop_messages, unread

ON, OFF = [0x90, 40, 100], [0x80, 40, 0]


SOURCE = """
import collections, json, sys, time
from livebass.bench.jack import new_client

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
        before = len(arrived(synth))
        for _ in range(20):
            self.send(message)
            with contextlib.suppress(AssertionError):
                return wait_for(lambda: len(arrived(synth)) > before, PATIENCE / 20)
        raise AssertionError("waited in vain")

    def unplug(self) -> None:
        self.process.kill()
        self.process.communicate()


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


# ---- JACK's messages, by a server on a virtual clock


@contextmanager
def heard_by_jack(rate: int, delay: int = 64) -> Iterator[tuple[JackMidi, Server, Synth]]:
    """Ports of JACK that play a synth of `rate` whose block of 512 frames begins at frame 1000."""
    with fake_jack() as server:
        ports, synth = JackMidi("livebass"), Synth(rate)
        ports.synth, ports.delay = synth, delay
        ports.open_virtual()
        synth.record["block_frame"], synth.record["block_frames"] = 1000, 512
        yield ports, server, synth
        ports.close()


@pytest.mark.parametrize(("rate", "step"), [(RATE, 1), (2 * RATE, 2)])
def test_a_message_from_jack_keeps_its_place_in_the_period(rate: int, step: int) -> None:
    """Also if the server calls late. Before the first block messages play at once."""
    with heard_by_jack(rate) as (_, server, synth):
        server.midi = [(3, bytes(ON))]
        server.period()
        assert [frame for frame, *_ in pop_messages(synth.rings[2])] == [NOW]
        synth.record["block_time"], synth.record["clock"] = 1, 0  # the clock stands still as the block begins
        for since in (0, 7):
            server.since, server.midi = since, [(0, bytes(ON)), (0, bytes(OFF)), (10, bytes(ON)), (200, bytes(OFF))]
            server.period()
            frames = [frame - 1000 - 64 for frame, *_ in pop_messages(synth.rings[2])]
            assert frames == [step * (place - since) for place in (0, 0, 10, 200)]


def test_what_jack_hands_over() -> None:
    """Whole channel messages of the synth's channel, in order; a learned controller moves its parameter."""
    with heard_by_jack(RATE) as (ports, server, synth):
        synth.record["channel"] = 0
        for message in (ON, [0xF8], [0xF0, 1, 2, 0xF7], [0x91, 40, 1], [0x90, 40], [0xC0, 3], [0x90, 200, 1], OFF):
            server.midi.append((1, bytes(message)))
        server.period()
        assert [message for _, *message in pop_messages(synth.rings[2])] == [ON, [0xC0, 3, 0], OFF]
        desk = Desk()
        desk.learn("tone", 74)
        ports.synth = other = Synth(RATE, desk=desk)
        server.midi = [(0, bytes([0xB0, 74, 5])), (0, bytes(ON))]
        server.period()
        assert not unread(synth.rings[2]), "of the synth before"
        (_, *first), (_, *second) = pop_messages(other.rings[2])
        assert first != [0xB0, 74, 5] and second == ON


# ---- a system's ports, by a library made for the test


class System:
    """The module supriya_midi on a system with the ports `names`."""

    RtMidiErrorType = SimpleNamespace(WARNING="warning", DEBUG_WARNING="debug", DRIVER_ERROR="driver")

    def __init__(self, *names: str, there: bool = True) -> None:
        self.ports, self.there = list(names), there
        self.opened: dict[str, SystemInput] = {}  # by the port
        self.done: list[object] = []  # by livebass, in order
        self.fails = ""  # what opening a port reports

    def get_compiled_apis(self) -> list[int]:
        return [2, 3, 5]

    def get_api_name(self, api: int) -> str:
        return {2: "alsa", 3: "jack", 5: "dummy"}[api]

    def MidiIn(self, api: int, name: str) -> SystemInput:
        assert api == 2, "JACK's ports have their own client"
        if not self.there:
            raise RuntimeError("MidiInAlsa::initialize: error creating ALSA sequencer client object.")
        return SystemInput(self)


class SystemInput:
    """One of its inputs, which may fail as RtMidi does."""

    def __init__(self, system: System) -> None:
        self.system = system

    def set_error_callback(self, report: Callable[[str, str, object], None]) -> None:
        self.report = report

    def set_callback(self, heard: Callable[[list[int], float, object], None]) -> None:
        self.heard = heard

    def get_port_count(self) -> int:
        return len(self.system.ports) + 1  # one has vanished

    def get_port_name(self, number: int) -> str:
        if number >= len(self.system.ports):
            self.report("warning", "MidiInAlsa::getPortName: error looking for port name!", None)
            return ""
        return self.system.ports[number]

    def open_port(self, number: int, name: str) -> None:
        if self.system.fails:
            self.report("driver", self.system.fails, None)
        self.system.opened[self.system.ports[number]] = self

    def open_virtual_port(self, name: str) -> None:
        self.system.opened[name] = self

    def close_port(self) -> None:
        self.system.done.append("close")

    def delete(self) -> None:
        self.system.opened = {name: port for name, port in self.system.opened.items() if port is not self}


@pytest.fixture
def system(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> System:
    made = System(f"{THROUGH}:{THROUGH} Port-0 14:0", "Keystation:MIDI 1 24:0", "livebass:in 128:0")

    def disconnect(*names: str) -> bool:
        made.done.append(names)
        return True

    monkeypatch.setattr(systemmidi, "rtmidi_library", lambda: made)
    monkeypatch.setattr(systemmidi, "disconnect", disconnect)
    monkeypatch.setattr(systemmidi, "QUIET", 0.0)
    monkeypatch.setattr(systemmidi, "ALSA_CLIENTS", tmp_path / "clients")
    monkeypatch.setenv("JACK_DEFAULT_SERVER", "nobody")
    return made


def test_a_port_of_the_system_that_goes_and_comes(system: System) -> None:
    """Its address is another one then; ports that have just vanished, and livebass' own, are no ports."""
    assert port_names() == system.ports[:2]
    synth = Synth(RATE)
    port = MidiPort(synth, None, 64)
    assert port.name == "Keystation:MIDI 1 24:0" and port.look() is None
    opened = system.opened[port.name]
    opened.heard(ON, 0.0, None)
    opened.report("warning", "MidiInAlsa::alsaMidiHandler: MIDI input buffer overrun, messages were lost!", None)
    opened.heard([0xF8], 0.0, None)
    opened.heard([0xC0, 3], 0.0, None)
    assert arrived(synth) == [ON, [0xC0, 3, 0]]
    system.ports[1:2] = []
    assert port.look() == "MIDI: Keystation:MIDI 1 24:0 is gone, waiting for it" and not system.opened
    assert port.look() is None
    system.ports.insert(0, "Keystation:MIDI 1 32:0")
    assert port.look() == "MIDI: Keystation:MIDI 1 32:0 is back"
    port.synth = other = Synth(RATE)
    system.opened["Keystation:MIDI 1 32:0"].heard(OFF, 0.0, None)
    assert arrived(other) == [OFF]
    port.close()
    port.close()
    assert not system.opened


def test_a_port_is_disconnected_before_it_is_closed(system: System) -> None:
    """And not closed while messages still come: supriya-midi's thread and this one would wait for each other."""
    port = MidiPort(Synth(RATE), None, 64)
    ports = port._ports
    assert isinstance(ports, SystemMidi)
    system.done.clear()
    counts = iter([1, 2, 3])

    def pause(_seconds: float) -> None:
        system.done.append("pause")
        ports._count = next(counts, 3)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(systemmidi.time, "sleep", pause)
        port._leave()
    assert system.done == [("in",), "pause", "pause", "pause", "pause", "close"]
    assert port.look() == "MIDI: Keystation:MIDI 1 24:0 is back"
    system.done.clear()
    assert port_names() and system.done == ["close"], "other ports of this process stay connected"
    port.close()
    assert system.done[1] == ("in",)


def test_a_port_that_cannot_be_opened(system: System) -> None:
    system.fails = "MidiInAlsa::openPort: ALSA error making port connection."
    with pytest.raises(MidiLost, match=r"^MIDI input Keystation:MIDI 1 24:0: MidiInAlsa::openPort"):
        MidiPort(Synth(RATE), None, 64)
    system.fails = ""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SystemInput, "open_port", lambda self, number, name: self.system.ports.pop(0))
        with pytest.raises(MidiLost, match="other ports have come or gone"):
            MidiPort(Synth(RATE), None, 64)


def test_a_system_without_ports_has_a_virtual_one(system: System) -> None:
    system.ports = []
    synth = Synth(RATE)
    port = MidiPort(synth, None, 64)
    assert port.name == "virtual port livebass"
    system.opened["livebass"].heard(ON, 0.0, None)
    assert arrived(synth) == [ON]
    systemmidi.ALSA_CLIENTS.write_text(ALSA)
    system.ports = ["Keystation:MIDI 1 24:0"]
    assert port.look() is None, "connected by hand"
    port.close()


# ---- what may be missing


def test_without_midi_one_line_says_what_is_missing(system: System) -> None:
    system.there = False
    for jack, why in ((True, "no JACK server, and no answer from ALSA's sequencer"), (False, "no answer from ALSA's")):
        with pytest.raises(NoMidi, match=f"^no MIDI ports: {why}"):
            MidiPort(Synth(RATE), None, 64, jack=jack)


@pytest.mark.parametrize(
    ("error", "says"),
    [
        ("ModuleNotFoundError('no supriya_midi')", install("live")),
        ("ImportError('libasound.so.2: cannot open shared object file')", "sudo apt install libportaudio2"),
        ("OSError('libjack: wrong\\nELF class')", "libjack: wrong ELF class; "),
    ],
)
def test_a_missing_library_is_named(error: str, says: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "supriya_midi.py").write_text(f"raise {error}")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "supriya_midi", raising=False)
    with pytest.raises(NoMidi) as said:
        MidiPort(Synth(RATE), None, 64, jack=False)
    assert says in str(said.value) and "\n" not in str(said.value)


def test_jack_needs_no_other_library(source: Source, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "supriya_midi", None)
    synth = Synth(RATE)
    port = MidiPort(synth, None, 64)
    try:
        assert port.name == "test-keys:out"
        source.reach(synth, ON)
        assert all(message == ON for message in arrived(synth))
    finally:
        port.close()


# ---- names


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
    Connected From: 32:0[r:0], 33:1
Client 130 : "other" [User]
  Port   0 : "in" (-We-)
    Connected From: 24:0
"""


def test_what_alsa_shows_of_connections() -> None:
    assert alsa_sources(ALSA) == {"24:0", "28:1"}
    assert not alsa_sources("")
    assert alsa_connections(ALSA, "in") == [("129:0", "32:0"), ("129:0", "33:1")]


def test_whole_messages_only() -> None:
    whole = [ON, OFF, [0xC0, 3], [0xD1, 3], [0xE0, 0, 127], [0x9F, 127, 0]]
    broken = [[], [0x90], [0x90, 40], [0x90, 40, 100, 1], [0xC0], [0xC0, 3, 0], [0x90, 200, 1], [0x40, 1, 2], [0xF8]]
    assert all(map(is_message, whole)) and not any(map(is_message, broken))


def test_a_port_that_is_not_there_is_named(source: Source) -> None:
    for wanted in ("nix", "17"):
        with pytest.raises(MidiLost, match=f"'{wanted}': not found; there is .*test-keys"):
            MidiPort(Synth(48000), wanted, 64)


@pytest.mark.parametrize(
    "extra", [("--backend", "portaudio", "--midi", "test-keys"), ("--midi", "test-keys"), ("--midi", "0")]
)
def test_the_whole_program(source: Source, tmp_path: Path, extra: tuple[str, ...]) -> None:
    """A MIDI source plays livebass, beside or straight into its JACK client; the sound lands in the take."""
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
