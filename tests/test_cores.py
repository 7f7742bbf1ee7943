"""Counts the cores that this process may use."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

COUNT = "from livebass.cores import core_count; print(core_count())"


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux keeps a process to some of its cores")
def test_a_process_kept_to_one_core_has_one() -> None:
    def keep() -> None:
        os.sched_setaffinity(0, list(os.sched_getaffinity(0))[:1])

    done = subprocess.run([sys.executable, "-c", COUNT], preexec_fn=keep, capture_output=True, text=True, check=True)
    assert done.stdout == "1\n"
