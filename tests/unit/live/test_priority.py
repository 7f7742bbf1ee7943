"""Real-time priority: granted by the scheduler or rtkit, or refused with a reason. Here rtkit is a script."""

from __future__ import annotations

import os
import resource
import sys
import threading
from pathlib import Path

import pytest

from livebass.live.priority import make_realtime

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="Linux schedules so")


def refuse(*_: object) -> None:
    raise PermissionError(1, "Operation not permitted")


@pytest.fixture
def rtkit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A busctl that logs its calls and answers as the file `answer` says; the scheduler refuses."""
    script = tmp_path / "busctl"
    script.write_text(f'#!/bin/sh\necho "$@" >{tmp_path}/requested\n. {tmp_path}/answer\n')
    script.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    monkeypatch.setattr(resource, "setrlimit", lambda *_: None)  # it would affect all tests that follow
    return tmp_path


def test_rtkit_is_asked_for_the_thread(rtkit: Path) -> None:
    (rtkit / "answer").write_text("exit 0\n")
    assert make_realtime(threading.get_native_id()) is None
    requested = (rtkit / "requested").read_text().split()
    assert requested[-5:] == [
        "MakeThreadRealtimeWithPID",
        "ttu",
        str(os.getpid()),
        str(threading.get_native_id()),
        "20",
    ]


def test_a_refusal_says_why(rtkit: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (rtkit / "answer").write_text("echo Call failed: no such service >&2\nexit 1\n")
    said = make_realtime(threading.get_native_id())
    assert said == (
        "operation not permitted, and rtkit says: Call failed: no such service; install rtkit, or allow rtprio"
    )
    monkeypatch.setenv("PATH", str(rtkit / "nowhere"))
    assert "busctl" in (make_realtime(threading.get_native_id()) or "")


def test_a_thread_that_has_it_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getscheduler", lambda thread: os.SCHED_FIFO | os.SCHED_RESET_ON_FORK)
    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert make_realtime(1) is None
