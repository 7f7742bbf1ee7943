"""tools/bare: a system that has nothing of this one."""

from __future__ import annotations

import os
import shutil
import subprocess

from support import needs
from support.places import ROOT


def test_a_bare_system_has_nothing_of_this_one() -> None:
    """It is a user's, has Python, and neither a compiler nor JACK; the command's status is passed on."""
    if os.name != "posix" or os.getuid() or not shutil.which("dpkg-query") or not shutil.which("unshare"):
        needs.missing("root on Debian")
    look = "id -u; ls -A ~; python3 -c 'import ensurepip, venv'; which cc gcc jackd; touch /tmp/a /dev/shm/b; exit 7"
    done = subprocess.run(
        [ROOT / "tools/bare", "bash", "-c", look], capture_output=True, text=True, check=False, timeout=300
    )
    assert (done.returncode, done.stdout.split(), done.stderr) == (7, ["1000", "checkout"], "")
