"""Options of `play` with a JACK server: its client's name and ports, a session with a file, keys and settings."""

from __future__ import annotations

import re
import socket
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from support.jack import wait_for
from support.live import QUICK, played_on, session_of
from support.remote import Remote
from support.song import midi_file, song_of
from support.terminal import InTerminal

from livebass import load_preset
from livebass.cli.play_settings import load, settings_file
from livebass.lab.bench.jack import new_client
from livebass.live.osc import OscLost
from livebass.live.session import Session
from livebass.live.settings import Settings
from livebass.live.synth import Synth
from livebass.score.score import score_of


def connections(client: Any, name: str) -> dict[str, int]:
    """The number of connections of each port of the client `name`."""
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


def test_what_cannot_be_is_said_before_anything_sounds(server: SimpleNamespace) -> None:
    """A loop outside the file, and a port of another program; the client is closed."""
    looker = new_client("looker")
    default = Settings(load_preset("slap"), QUICK, "slap", backend="jack", keyboard=False, client="refused",
                     read=lambda rate: score_of([(0.0, 1.0, 33, 100)], rate))  # fmt: skip
    try:
        with pytest.raises(ValueError, match=r"within the 1\.0 s"):
            Session(replace(default, loop=(5.0, 9.0))).run()
        pytest.importorskip("pythonosc")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind(("127.0.0.1", 0))
            port = taken.getsockname()[1]
            with pytest.raises(OscLost, match=f"--osc {port}"):
                Session(replace(default, osc=port)).run()
        assert not looker.get_ports("^refused")
    finally:
        looker.close()


def test_a_session_with_a_file_keys_and_settings(server: SimpleNamespace, lend: Any, tmp_path: Path) -> None:
    """The keys of a file, MIDI learn by a key, the control socket, and the remembered settings."""
    pytest.importorskip("pythonosc")
    (tmp_path / "song.mid").write_bytes(midi_file(song_of([30 + k % 5 for k in range(40)], 480, program=36)))
    arguments = (
        "--file", tmp_path / "song.mid", "--loop", "1s:2s", "--learn", "tone=74", "--record", tmp_path / "take.wav",
        "--record-midi", tmp_path / "take.mid", "--osc", free_port(),
    )  # fmt: skip
    terminal = lend(InTerminal("play", "--quality", "live", "--backend", "jack", *arguments, columns=160))
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
    kept = load(settings_file())
    assert kept.controllers == {"tone": 74} and kept.preset not in (None, "slap") and kept.backend is None
    assert f"; {tmp_path / 'take.wav'} and {tmp_path / 'take.mid'}" in " ".join(terminal.shown.split())
    assert "Traceback" not in terminal.shown


def free_port() -> int:
    """A free UDP port of this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
