"""The cores that this process may use, and the threads of its linear algebra."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from support.command import python_output

from livebass.system.cores import ONE_THREAD

COUNT = "from livebass.system.cores import core_count; print(core_count())"


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux keeps a process to some of its cores")
def test_a_process_kept_to_one_core_has_one() -> None:
    def keep() -> None:
        os.sched_setaffinity(0, list(os.sched_getaffinity(0))[:1])

    assert python_output("-c", COUNT, preexec_fn=keep) == "1\n"


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux lists a process's threads as files")
def test_the_command_computes_sums_in_one_thread() -> None:
    """Two threads round differently from one: the same recording would give other partials on another machine."""
    code = (
        "import os, sys; from livebass.__main__ import main\n"
        "try: main()\n"
        "finally: import numpy; print(len(os.listdir('/proc/self/task')))"
    )
    surroundings = {name: value for name, value in os.environ.items() if name not in ONE_THREAD}
    line = [sys.executable, "-c", code, "--version"]
    done = subprocess.run(line, env=surroundings, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "1"
