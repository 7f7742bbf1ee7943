"""A JACK server that ends, in the last file with servers: the library may crash in a process that saw one end."""

from __future__ import annotations

import signal
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace

import soundfile
from support.jack import PATIENCE, playing, wait_for_log, wait_for_take


def test_a_server_that_goes_away_ends_the_session(server: SimpleNamespace, tmp_path: Path) -> None:
    """Through JACK and through PortAudio, which then hangs."""
    names = ("jack", "portaudio")
    takes, logs = ([tmp_path / f"{name}.{ending}" for name in names] for ending in ("wav", "log"))
    with ExitStack() as ends:
        processes = [
            ends.enter_context(playing("--backend", name, "--record", take, "--log", log))
            for name, take, log in zip(names, takes, logs, strict=True)
        ]
        for process, take, log in zip(processes, takes, logs, strict=True):
            wait_for_log(log, "playing", process=process)
            wait_for_take(take, 0.1)
        server.process.send_signal(signal.SIGTERM)
        server.process.wait(PATIENCE)
        for process, take in zip(processes, takes, strict=True):
            _, err = process.communicate(timeout=PATIENCE)
            assert process.returncode == 1, err
            assert f"is gone; {take} is complete" in err.splitlines()[-1] and "Traceback" not in err
            assert soundfile.info(take).frames > 0
