"""The thread rules of the plugins' C, checked in test builds: a violation names its function."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from support.plugins import c_host

from livebass.plugin.systems import this_system

pytestmark = pytest.mark.skipif(this_system().name != "linux-x86_64", reason="a host for Linux")
BASSES = ("slap",)
ALLOWED = ("nothing", "offline")
BROKEN = {
    "lock": "livebass: enter: the audio thread may not wait\n",
    "load": "livebass: enter: the audio thread may not wait\n",
    "two threads": "livebass: lb_reset_instance: another thread is at work there\n",
}


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return c_host(tmp_path_factory.mktemp("rules"), "rulehost", "-DLB_CHECK_THREADS")


@pytest.mark.parametrize("case", [*ALLOWED, *BROKEN])
def test_a_broken_rule_aborts_with_its_function(instruments: Path, host: Path, case: str) -> None:
    done = subprocess.run([host, instruments, case], capture_output=True, text=True, timeout=60)
    assert done.stderr == BROKEN.get(case, "") and (done.returncode == 0) == (case in ALLOWED)


def test_releases_check_nothing(instruments: Path, tmp_path: Path) -> None:
    host = c_host(tmp_path, "rulehost")
    assert subprocess.run([host, instruments, "lock"], timeout=60).returncode == 0
    assert b"may not wait" not in host.read_bytes()
