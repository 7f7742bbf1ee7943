"""MIDI ports: of the JACK server, and of a system made for the test, as a test machine has no MIDI of its own."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from support.fakejack import RATE, Server, fake_jack
from support.live import OFF, ON, waiting_messages

from livebass.live import systemmidi
from livebass.live.desk import Desk
from livebass.live.device_errors import MidiLost, NoMidi
from livebass.live.jackmidi import JackMidi
from livebass.live.midi import THROUGH, MidiPort, bare, find_port, port_names
from livebass.live.synth import Synth
from livebass.live.systemmidi import SystemMidi, alsa_connections, alsa_sources, is_message
from livebass.live.thread.ring import NOW, pop_messages, unread
from livebass.system.extras import install

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
    assert waiting_messages(synth) == [ON, [0xC0, 3, 0]]
    system.ports[1:2] = []
    assert port.look() == "MIDI: Keystation:MIDI 1 24:0 is gone, waiting for it" and not system.opened
    assert port.look() is None
    system.ports.insert(0, "Keystation:MIDI 1 32:0")
    assert port.look() == "MIDI: Keystation:MIDI 1 32:0 is back"
    port.synth = other = Synth(RATE)
    system.opened["Keystation:MIDI 1 32:0"].heard(OFF, 0.0, None)
    assert waiting_messages(other) == [OFF]
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
    assert waiting_messages(synth) == [ON]
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


def test_names_and_numbers() -> None:
    names = [f"{THROUGH}:{THROUGH} Port-0 14:0", "Keystation:MIDI 1 24:0", "Launchkey:MIDI 1 28:0"]
    chosen: list[tuple[Any, Any]] = [
        (None, 1), ("0", 0), ("2", 2), ("3", None), ("launch", 2), ("midi 1", 1), ("nix", None),
    ]  # fmt: skip
    assert [find_port(names, wanted) for wanted, _ in chosen] == [index for _, index in chosen]
    assert find_port(names[:1], None) is None
    assert bare(names[1]) == bare("Keystation:MIDI 1 32:0") != bare(names[2])
