"""`livebass play` with a JACK server: terminals, signals, a full disk, options that fit nothing."""

from __future__ import annotations

import os
import re
import resource
import signal
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import soundfile
from support.command import Run, assert_one_clear_line
from support.jack import PATIENCE, end, livebass, playing, wait_for, wait_for_log, wait_for_take
from support.live import RATE
from support.terminal import InTerminal


def test_a_full_disk_ends_with_status_1(server: SimpleNamespace, tmp_path: Path) -> None:
    """No file may grow beyond 100 kB; the session plays on until it is ended."""
    take, log = tmp_path / "take.wav", tmp_path / "log"

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

    with playing("--backend", "jack", "--record", take, "--log", log, preexec_fn=limit) as process:
        wait_for_log(log, "are kept", process=process)
        assert process.poll() is None
        err = end(process, signal.SIGINT)
    assert process.returncode == 1
    assert err.splitlines()[-1].startswith("livebass: error: not all was recorded: ") and "take.wav" in err
    assert soundfile.info(take).frames > 25000


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_playing_in_a_narrow_terminal(server: SimpleNamespace, lend: Any, number: signal.Signals) -> None:
    terminal = lend(InTerminal("play", "--quality", "live", columns=44))
    terminal.wait("jazz-finger   load")
    assert not terminal.cooked
    terminal.type("zq")  # both, though they arrive together
    terminal.wait("E2(D:2")
    terminal.type("\x1b[A\t")  # an arrow is no note
    terminal.wait("preset muted, quality live")
    terminal.wait("muted   load")
    terminal.type("\r")
    terminal.wait("preset muted, quality studio")
    terminal.wait("   load", times=4)
    terminal.wait("\x1b[K")
    if number == signal.SIGINT:
        terminal.type("\x03")
    else:
        terminal.process.send_signal(number)
    terminal.wait("played ")
    terminal.wait("")
    assert terminal.process.wait(PATIENCE) == 0
    assert terminal.cooked
    shown = re.sub(r"\x1b\[\?(8[hl]|u)", "", terminal.shown)  # the keyboard's setup is not shown
    lines = re.findall(r"^ *(?:silent|-?\d+ dBFS)  .*", shown.replace("\r\x1b[K", "\n"), re.MULTILINE)
    assert len(lines) > 3 and max(map(len, lines)) < 44
    assert "Traceback" not in terminal.shown and "3 messages" in terminal.shown, terminal.shown


def test_after_ctrl_z_and_fg_keys_play_again(server: SimpleNamespace, lend: Any) -> None:
    """In a shell that leaves the terminal unchanged. The keys need no Enter."""
    terminal = lend(InTerminal(shell=True))
    terminal.type(f"{sys.executable} -m livebass play --backend jack\n")
    terminal.wait("jazz-finger   load")
    terminal.type("\x1a")
    terminal.wait("Stopped")
    wait_for(lambda: terminal.cooked)
    terminal.type("fg\n")
    wait_for(lambda: not terminal.cooked)
    terminal.type("c")
    terminal.wait("G#1(E:4")
    terminal.type("\x03")
    terminal.wait("played ")
    wait_for(lambda: terminal.cooked)


def test_a_terminal_that_is_closed_ends_it_and_keeps_the_take(
    server: SimpleNamespace, lend: Any, tmp_path: Path
) -> None:
    take = tmp_path / "take.wav"
    terminal = lend(InTerminal("play", "--record", take))
    terminal.wait("underruns")
    wait_for_take(take, 0.5)
    os.close(terminal.ours)
    terminal.ours = os.open(os.devnull, os.O_RDONLY)
    terminal.process.wait(PATIENCE)
    assert soundfile.info(take).frames > RATE // 4


def test_options_that_fit_nothing_are_one_line(server: SimpleNamespace, run: Run, tmp_path: Path) -> None:
    for arguments in (
        ("--midi", "nix"), ("--file", tmp_path / "nix.mid"), ("--record", tmp_path / "a.mp3"), ("-p", "nix"),
        ("--block", 1), ("--audio", "0", "--backend", "jack"), ("--record-midi", tmp_path / "no" / "a.mid"),
    ):  # fmt: skip
        done = livebass("play", *arguments)
        _, err = done.communicate(timeout=PATIENCE)
        assert_one_clear_line(done.returncode, err)
    assert not os.listdir(tmp_path)
