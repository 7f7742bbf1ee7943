"""Options of `play` through a real JACK server: ports, names, transport, learned controllers, control socket, keys."""

from __future__ import annotations

import re
import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import soundfile
from support.jack import JACK_RATE, wait_for
from support.live import QUICK, played_on, session_of, synth_and_device
from support.terminal import InTerminal

from livebass import load_preset
from livebass.arrays import Floats
from livebass.bench.jack import MidiProbe, new_client
from livebass.cli.remembered import load, settings_file
from livebass.live.control import control_table, meter_table, tuner_meters
from livebass.live.desk import Desk
from livebass.live.osc import OscLost, OscServer
from livebass.live.outputs import JackOutput
from livebass.live.parameters import NUMBERS, PARAMETERS, event
from livebass.live.presets import PresetSwitch
from livebass.live.session import Session, Settings
from livebass.live.synth import Gauge, LiveBass, Meters, Synth
from livebass.score.score import score_of
from livebass.techniques import LEARNED, SLIDER_ROWS

RATE = JACK_RATE


class Ears:
    """A client that hears several ports at once; `periods` has what each gave, by period."""

    def __init__(self, ports: list[Any]) -> None:
        self.client = new_client("ears")
        mine = [self.client.inports.register(f"in_{k}") for k in range(len(ports))]
        self.periods: list[list[Floats]] = []
        self.client.set_process_callback(lambda _: self.periods.append([p.get_array().copy() for p in mine]))
        self.client.activate()
        for theirs, port in zip(ports, mine, strict=True):
            self.client.connect(theirs, port)

    def heard(self) -> list[Floats]:
        """All that each port gave, end to end."""
        return [np.concatenate(parts) for parts in zip(*self.periods, strict=True)]

    def close(self) -> None:
        self.client.deactivate(ignore_errors=True)
        self.client.close(ignore_errors=True)


@contextmanager
def playing(desk: Desk, preset: str = "jazz-finger", **more: Any) -> Iterator[JackOutput]:
    """A client of the server with a desk."""
    output = JackOutput("rig", lambda rate: Synth(rate, adaptive=False, desk=desk), connect=False, **more)
    output.synth.keep_messages()
    output.synth.switch_to(LiveBass(load_preset(preset), QUICK, output.synth.rate))
    try:
        yield output
    finally:
        output.close()


def test_every_string_has_a_port_and_all_add_up_to_the_mix(server: SimpleNamespace) -> None:
    with playing(Desk()) as output:
        output.open_strings(4)
        output.start()
        assert [port.shortname for port in output.client.outports] == [
            "out_1", "out_2", "string_1", "string_2", "string_3", "string_4",
        ]  # fmt: skip
        ears = Ears([output.outputs[0], *output._strings])
        try:
            wait_for(lambda: len(ears.periods) > 20)
            for key in (28, 40):
                output.synth.send(0x90, key, 100)
            played_on(output.synth, 0.4)
        finally:
            ears.close()
        mix, *strings = ears.heard()
        assert [bool(s.any()) for s in strings] == [True, False, True, False]
        assert np.array_equal(mix, strings[0] + strings[2]) and np.abs(mix).max() > 0.01
        output.open_strings(5)  # another bass has one more
        assert output.client.outports[-1].shortname == "string_5"
        played_on(output.synth, 0.1)


def test_the_metronome_may_have_a_port_of_its_own(server: SimpleNamespace) -> None:
    desk = Desk()
    with playing(desk, click_port=True) as output:
        output.start()
        ears = Ears([output.outputs[0], output.click])
        try:
            desk.click(300.0, RATE, output.synth.frame)
            wait_for(lambda: len(ears.periods) > 20 and any(p[1].any() for p in ears.periods))
            played_on(output.synth, 0.3)
        finally:
            ears.close()
        mix, clicks = ears.heard()
        assert not mix.any() and np.abs(clicks).max() > 0.1


def test_a_learned_controller_is_heard_by_the_audio_thread(server: SimpleNamespace) -> None:
    desk = Desk()
    desk.learn("tone", 74)
    with playing(desk) as output:
        output.start()
        midi = MidiProbe()
        try:
            midi.client.activate()
            midi.client.connect(midi.port, output.midi)

            def moved(controller: int, value: int, done: Callable[[], object]) -> None:
                """A server drops what comes in the cycle in which it connects two ports."""
                for _ in range(50):
                    midi.send(5, 0xB0, controller, value)
                    end = time.monotonic() + 0.2
                    while time.monotonic() < end and not done():
                        time.sleep(0.01)
                    if done():
                        return
                raise AssertionError("waited in vain")

            moved(74, 127, lambda: output.synth.parameter(NUMBERS["tone"]) == 1)
            assert desk.moved[1] == 74
            assert [m[1:] for m in output.synth.played()][-1:] == [(0xB0, LEARNED + NUMBERS["tone"], 127)], "for takes"
            moved(21, 3, lambda: desk.moved[1] == 21)
            wait_for(lambda: [m[1:] for m in output.synth.played()][-1:] == [(0xB0, 21, 3)])
        finally:
            midi.close()


def test_the_score_follows_jacks_transport(server: SimpleNamespace) -> None:
    """It starts, stops and goes where the transport does, to the frame."""
    score = score_of([(0.5 * k, 2.0 if k == 20 else 0.2, 30 + k, 100) for k in range(24)], RATE)
    desk = Desk()
    with playing(desk) as output:
        desk.load(score)
        desk.rolling = True
        output.follow_transport(desk)
        output.client.transport_stop()
        output.locate(0.0)
        output.start()
        try:
            played_on(output.synth, 0.3)
            assert not output.synth.played() and not desk.rolling
            intervals = []
            for _ in range(8):  # a busy machine may lose whole periods, in which the transport goes on
                before = len(output.synth.played())
                output.locate(2.25)
                wait_for(lambda: desk.position == pytest.approx(2.25))
                output.roll(True)
                wait_for(lambda: desk.position > 3.2)
                output.roll(False)
                wait_for(lambda: not desk.rolling)
                state, place = output.client.transport_query()
                assert desk.position == pytest.approx(place["frame"] / RATE, abs=1e-9) and "STOPPED" in str(state)
                notes = [m[:3:2] for m in output.synth.played()[before:] if m[1] == 0x90]
                assert [key for _, key in notes] == [35, 36]
                intervals.append(notes[1][0] - notes[0][0])
                assert (RATE // 2 - intervals[-1]) % output.block == 0 and intervals[-1] <= RATE // 2
                if intervals[-1] == RATE // 2:
                    break
            assert intervals[-1] == RATE // 2, intervals
            output.locate(10.25)
            output.roll(True)
            wait_for(lambda: desk.position > 10.55)
            output.locate(1.25)
            wait_for(lambda: 1.6 < desk.position < 3)
            sent = [m[1:3] for m in output.synth.played()]
            assert (0x90, 33) in sent and (0x80, 51) in sent
            output.locate(9.9)
            wait_for(lambda: desk.position > 10.1)
            output.roll(False)
            wait_for(lambda: (0x80, 50) in [m[1:3] for m in output.synth.played()])
        finally:
            output.client.transport_stop()
            output.locate(0.0)


def connections(client: Any, name: str) -> dict[str, int]:
    """How many connections each port of the client called `name` has."""
    return {p.shortname: len(client.get_all_connections(p)) for p in client.get_ports(f"^{re.escape(name)}:")}


@pytest.mark.parametrize("connect", [False, True])
def test_a_client_of_its_own_name_that_connects_nothing(server: SimpleNamespace, connect: bool) -> None:
    looker, seen = new_client("looker"), {}
    settings = Settings(load_preset("five-string"), QUICK, "five-string", backend="jack", keyboard=False,
                        client="low end", connect=connect, strings=True)  # fmt: skip

    def play(synth: Synth) -> None:
        played_on(synth, 0.1)
        seen.update(connections(looker, "low end"))

    try:
        summary = session_of(Session(settings), play)
    finally:
        looker.close()
    assert summary.output == "JACK client low end" and summary.preset == "five-string"
    assert seen == {
        "out_1": connect, "out_2": connect, "midi_in": 0, **{f"string_{k}": 0 for k in range(1, 6)},
    }  # fmt: skip


def test_a_take_names_the_sound_and_the_notes(server: SimpleNamespace, tmp_path: Path) -> None:
    takes = tmp_path / "take.wav", tmp_path / "take.mid"
    settings = Settings(
        load_preset("slap"), QUICK, "slap", backend="jack", keyboard=False, record=takes[0], record_midi=takes[1],
        tuner=True, metronome=240.0,
    )  # fmt: skip
    session, shown = Session(settings), []
    session.status = shown.append

    def play(synth: Synth) -> None:
        synth.send(0x90, 33, 60)
        played_on(synth, 0.8)

    summary = session_of(session, play)
    assert set(summary.recorded) == set(takes)
    assert any(
        re.match(r"A1 [+-]\d+ cents   \[#+ *\] +-\d+ dBFS   A1\(", line) and "metronome 240" in line for line in shown
    ), shown
    sound = soundfile.read(takes[0])[0]
    assert np.abs(sound[: RATE // 20]).max() < 0.2, "no click in it"


def test_what_cannot_be_is_said_before_anything_sounds(server: SimpleNamespace) -> None:
    """A loop that is not in the file, and a port that another program has; the client is closed."""
    looker = new_client("looker")
    usual = Settings(load_preset("slap"), QUICK, "slap", backend="jack", keyboard=False, client="refused",
                     read=lambda rate: score_of([(0.0, 1.0, 33, 100)], rate))  # fmt: skip
    try:
        with pytest.raises(ValueError, match=r"within the 1\.0 s"):
            Session(replace(usual, loop=(5.0, 9.0))).run()
        pytest.importorskip("pythonosc")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind(("127.0.0.1", 0))
            port = taken.getsockname()[1]
            with pytest.raises(OscLost, match=f"--osc {port}"):
                Session(replace(usual, osc=port)).run()
        assert not looker.get_ports("^refused")
    finally:
        looker.close()


# ---- the control socket


class Remote:
    """A program that sends OSC to a port of this machine and hears the answers."""

    def __init__(self, port: int) -> None:
        self.socket, self.port = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), port
        self.socket.settimeout(10)

    def send(self, name: str, *values: float | int | str) -> None:
        from pythonosc.osc_message_builder import OscMessageBuilder

        message: Any = OscMessageBuilder(f"/livebass/{name}")
        for value in values:
            message.add_arg(value)
        self.socket.sendto(message.build().dgram, ("127.0.0.1", self.port))

    def hear(self) -> tuple[str, list[Any]]:
        from pythonosc.osc_message import OscMessage

        message = OscMessage(self.socket.recv(65536))
        return message.address.removeprefix("/livebass/"), message.params

    def ask(self, name: str) -> Any:
        self.send(name)
        address, values = self.hear()
        assert address == name, (address, values)
        return values[0]


def test_the_control_socket_has_every_parameter_and_every_meter() -> None:
    pytest.importorskip("pythonosc")
    desk = Desk()
    desk.load(score_of([(0.0, 4.0, 30, 100)], 48000))
    synth, device = synth_and_device("jazz-finger", desk=desk)
    gauge, presets = Gauge(synth), PresetSwitch(synth, "jazz-finger", QUICK)
    controls = control_table(lambda: synth, desk, presets, lambda r: setattr(desk, "rolling", r), desk.seek)
    assert set(controls) >= {p.symbol for p in PARAMETERS} - SLIDER_ROWS.keys()  # a plugin builds its bass by those
    server = OscServer(0, controls, lambda: meter_table(gauge.read()) | tuner_meters(float("nan")))
    remote = Remote(server.port)

    def settles(name: str, value: float) -> None:
        def there() -> bool:
            device.block(64)
            return bool(remote.ask(name) == pytest.approx(value))

        wait_for(there)

    try:
        for p in (p for p in PARAMETERS if event(p)):
            for value in (p.most, p.least, p.usual):
                remote.send(p.symbol, value)
                settles(p.symbol, value)
        remote.send("technique", "plucked")
        settles("technique", 1.0)
        for name, value in (("relief", 0), ("running_ahead", 0), ("tempo", 0.5), ("metronome", 90.0), ("rolling", 1)):
            remote.send(name, value)
            settles(name, value)
        assert synth.bass is not None and synth.bass.record["share"][0] == 0
        for cores in (3, 1):
            remote.send("cores", cores)
            assert remote.ask("cores") == (1 if cores == 3 else 3), "until the main thread has seen to it"
            synth.follow_cores()
            assert remote.ask("cores") == cores
        remote.send("bass", "slap")
        remote.send("quality", 1)
        remote.send("note", 33, 100)
        assert remote.ask("bass") == "jazz-finger", "until it is prepared"
        assert presets.wanted == ("slap", "studio")
        device.block(64)
        assert synth.meters().messages == 1
        remote.send("panic")
        for name, *values in (
            ("gain", 99.0), ("gain", "loud"), ("gain", float("nan")), ("gain", 1, 2), ("nix",), ("note", 200, 1),
            ("bass", "nix"), ("bass", 77), ("loop", 3.9, 3.95), ("tempo", 9.0),
        ):  # fmt: skip
            remote.send(name, *values)
            address, (why,) = remote.hear()
            assert address == "error" and f"/livebass/{name}" in why and "\n" not in why
        remote.send("meters")
        meters = dict(remote.hear() for _ in range(15))
        assert {"meter/load", "meter/peak", "meter/underruns", "meter/overload"} <= set(meters)
        assert {field.name for field in fields(Meters)} <= {name.removeprefix("meter/") for name in meters}
        assert meters["meter/frequency"] == [0.0] and meters["meter/note"] == ["-"]
        remote.send("subscribe")
        wait_for(lambda: server._subscribers)
        server.publish()
        assert len([remote.hear() for _ in meters]) == len(meters)
        remote.send("unsubscribe")
        remote.socket.sendto(b"/nonsense\xff", ("127.0.0.1", server.port))
        wait_for(lambda: not server._subscribers)
        with pytest.raises(OscLost, match=str(server.port)):
            OscServer(server.port, controls, dict)
    finally:
        server.close()
        presets.close()


def test_without_python_osc_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pythonosc.dispatcher", None)
    with pytest.raises(OscLost, match=r"pip install 'python-osc"):
        OscServer(0, {}, dict)


# ---- the whole


def test_a_session_with_a_file_keys_and_settings(server: SimpleNamespace, tmp_path: Path) -> None:
    """The keys of a file, MIDI learn by a key, the control socket, and what is remembered."""
    mido = pytest.importorskip("mido")
    pytest.importorskip("pythonosc")
    track = mido.MidiTrack([mido.Message("program_change", program=36)])
    for k in range(40):
        track += [mido.Message("note_on", note=30 + k % 5), mido.Message("note_off", note=30 + k % 5, time=480)]
    midi = mido.MidiFile()
    midi.tracks.append(track)
    midi.save(tmp_path / "song.mid")
    arguments = (
        "--file", tmp_path / "song.mid", "--loop", "1s:2s", "--learn", "tone=74", "--record", tmp_path / "take.wav",
        "--record-midi", tmp_path / "take.mid", "--osc", free_port(),
    )  # fmt: skip
    terminal = InTerminal("play", "--quality", "live", "--backend", "jack", *arguments, columns=160)
    try:
        terminal.wait("file: k pause")
        terminal.wait("OSC at 127.0.0.1:")
        terminal.wait("loop 0:01 to 0:02")
        remote = Remote(arguments[-1])
        assert remote.ask("bass") == "slap"
        remote.send("meters")
        meters = dict(remote.hear() for _ in range(20))
        assert meters["meter/preset"] == ["slap"] and 0 < meters["meter/position"][0] < 2.1
        terminal.type("k")
        terminal.wait("paused")
        assert remote.ask("rolling") == 0
        terminal.type("<")
        terminal.wait("tempo 95%")
        terminal.type("f")
        wait_for(lambda: remote.ask("loop") == -1)
        terminal.type("\\")
        terminal.wait("MIDI learn: move a control for gain")
        terminal.type("k\t")
        terminal.wait(", quality live")
        terminal.type("\x03")
        terminal.wait("played ")
        terminal.wait("")
        assert terminal.process.wait(60) == 0
    finally:
        terminal.close()
    kept = load(settings_file())
    assert kept.controllers == {"tone": 74} and kept.preset not in (None, "slap") and kept.backend is None
    assert f"; {tmp_path / 'take.wav'} and {tmp_path / 'take.mid'}" in " ".join(terminal.shown.split())
    assert "Traceback" not in terminal.shown


def free_port() -> int:
    """A UDP port of this machine that nobody uses now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
