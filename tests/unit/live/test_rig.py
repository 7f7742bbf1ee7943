"""Options of `play` through a JACK server: ports, names, transport, learned controllers, control socket, keys."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from support.fakejack import PERIOD, RATE, Server, fake_jack
from support.jack import wait_for
from support.live import QUICK, offline, played_on, session_of, synth_and_device
from support.remote import Remote

from livebass import load_preset
from livebass.live.control import control_table, meter_table, tuner_meters
from livebass.live.desk import Desk
from livebass.live.jack import JackOutput
from livebass.live.osc import OscLost, OscServer
from livebass.live.parameters import NUMBERS, PARAMETERS
from livebass.live.presets import PresetSwitch
from livebass.live.session import Session
from livebass.live.settings import Settings
from livebass.live.synth import Gauge, LiveBass, Meters, Synth
from livebass.rows.techniques import LEARNED, PARAMETER, SLIDER_ROWS, event
from livebass.score.score import score_of


@contextmanager
def playing(desk: Desk, preset: str = "jazz-finger", **more: Any) -> Iterator[tuple[JackOutput, Server]]:
    """A client with a desk, and its server."""
    with fake_jack() as server:
        output = JackOutput("rig", lambda rate: Synth(rate, adaptive=False, desk=desk), connect=False, **more)
        output.synth.keep_messages()
        output.synth.switch_to(LiveBass(load_preset(preset), QUICK, output.synth.rate))
        output.start()
        try:
            yield output, server
        finally:
            output.close()


def messages(output: JackOutput) -> list[tuple[int, int, int, int]]:
    """The synth's messages since the last call: frame and bytes."""
    return [(int(m[0]), *map(int, m[1:4])) for m in output.synth.played()]


@pytest.mark.parametrize("offset", [0, 1, 14, 100, PERIOD - 1])
def test_notes_come_out_at_their_frame_as_rendered(offset: int) -> None:
    with playing(Desk(), "slap") as (_, server):
        assert not server.play(0.2)["out_1"].any(), "nothing sounds by itself"
        server.midi = [(offset, b"\x90\x28\x6e")]
        heard = server.play(0.4)["out_1"]
    expected = offline("slap", [(offset, 0x90, 40, 110)], len(heard))
    assert np.array_equal(heard, expected) and not heard[:offset].any() and np.abs(expected).max() > 0.01


def test_every_string_has_a_port_and_all_add_up_to_the_mix() -> None:
    with playing(Desk()) as (output, server):
        output.open_strings(4)
        for key in (28, 40):
            output.synth.send(0x90, key, 100)
        sounds = server.play(0.4)
        assert list(sounds) == ["out_1", "out_2", "string_1", "string_2", "string_3", "string_4"]
        mix, same, *strings = sounds.values()
        assert [bool(s.any()) for s in strings] == [True, False, True, False] and np.array_equal(mix, same)
        assert np.array_equal(mix, strings[0] + strings[2]) and np.abs(mix).max() > 0.01
        output.open_strings(5)  # another bass has one string more
        assert [*server.play(0.1)][-1] == "string_5"


def test_the_metronome_may_have_a_port_of_its_own() -> None:
    desk = Desk()
    with playing(desk, click_port=True) as (output, server):
        desk.click(300.0, RATE, output.synth.frame)
        sounds = server.play(0.5)
        assert not sounds["out_1"].any() and np.abs(sounds["metronome"]).max() > 0.1


def test_a_learned_controller_is_heard_by_the_audio_thread() -> None:
    desk = Desk()
    desk.learn("tone", 74)
    with playing(desk) as (output, server):
        for controller, value in ((74, 127), (21, 3)):
            server.midi = [(5, bytes([0xB0, controller, value]))]
            server.play(0.1)
            assert desk.moved[1] == controller
        assert output.synth.value(PARAMETER, NUMBERS["tone"]) == 1
        assert [m[1:] for m in messages(output)] == [(0xB0, LEARNED + NUMBERS["tone"], 127), (0xB0, 21, 3)], "for takes"


def test_the_score_follows_jacks_transport() -> None:
    """It starts, stops and moves with the transport, to the frame."""
    desk = Desk()
    with playing(desk) as (output, server):
        desk.load(score_of([(0.5 * k, 2.0 if k == 20 else 0.2, 30 + k, 100) for k in range(24)], RATE))
        desk.rolling = True
        output.follow_transport(desk)
        server.play(0.3)
        assert not messages(output) and not desk.rolling
        output.locate(2.25)
        server.play(0.1)
        assert desk.position == 2.25
        began = server.frame
        output.roll(True)
        server.play(1.0)
        output.roll(False)
        server.play(0.1)
        assert server.transport_frame == 2.25 * RATE + round(RATE / PERIOD) * PERIOD
        assert desk.position == server.transport_frame / RATE and not desk.rolling
        assert [(frame - began, key) for frame, status, key, _ in messages(output) if status == 0x90] == [
            (round(0.25 * RATE), 35), (round(0.75 * RATE), 36),
        ]  # fmt: skip
        output.locate(10.25)
        output.roll(True)
        server.play(0.4)
        assert not desk.position < 10.6
        output.locate(1.25)
        server.play(0.5)
        sent = [m[1:3] for m in messages(output)]
        assert (0x90, 33) in sent and (0x80, 51) in sent, "a note that had begun ends where it goes elsewhere"
        output.locate(9.9)
        server.play(0.3)
        output.roll(False)
        server.play(0.1)
        assert (0x80, 50) in [m[1:3] for m in messages(output)]


def test_a_take_names_the_sound_and_the_notes(tmp_path: Path) -> None:
    takes = tmp_path / "take.wav", tmp_path / "take.mid"
    settings = Settings(
        load_preset("jazz-finger"), QUICK, "jazz-finger", backend="jack", keyboard=False, record=takes[0],
        record_midi=takes[1], tuner=True, metronome=240.0, connect=False,
    )  # fmt: skip
    shown: list[str] = []
    session = Session(settings, shown.append)

    def tuned() -> bool:
        wanted = re.compile(r"A1 [+-]\d+ cents   \[#+ *\] +-\d+ dBFS   A1\(.*metronome 240")
        return any(wanted.match(line) for line in shown)

    def play(synth: Synth) -> None:
        synth.send(0x90, 33, 45)
        played_on(synth, 0.8)
        wait_for(tuned)

    with fake_jack(runs=True):
        summary = session_of(session, play)
    assert set(summary.recorded) == set(takes)
    assert tuned(), shown
    sound = soundfile.read(takes[0])[0]
    assert np.abs(sound[: RATE // 20]).max() < 0.2, "no click in it, which is louder than the note"


# ---- the control socket


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
            for value in (p.maximum, p.minimum, p.default):
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
            ("loop", 0.0, float("inf")), ("loop", float("inf"), 1.0), ("loop", float("nan"), 1.0), ("loop", 1.0, 1e9),
            ("metronome", float("inf")), ("position", float("-inf")), ("tempo", None), ("gain", b"1"),
            ("note", 33, [1]),
        ):  # fmt: skip
            remote.send(name, *values)
            address, (why,) = remote.hear()
            assert address == "error" and f"/livebass/{name}" in why
            assert "\n" not in why and "()" not in why, "one line, without the names of functions"
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


# ---- everything together
