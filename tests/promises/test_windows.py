"""What Python lacks on Windows is missing here, too: every room can be imported, and commands run."""

from __future__ import annotations

import json
from pathlib import Path

from support.command import python

# Packages come first: theirs are made for each system. The names are those that the documentation marks "Unix".
PROGRAM = '''
import importlib, os, pkgutil, signal, sys
import asyncio, concurrent.futures.process, http.server, multiprocessing.pool, subprocess, tempfile, webbrowser
for package in ("numpy", "numba", "soundfile", "click", "mido", "platformdirs", "charset_normalizer", "scipy.signal",
                "matplotlib.figure", "cmaes", "distributed", "guitarpro", "sounddevice", "pythonosc", "tomlkit"):
    try:
        importlib.import_module(package)
    except (ImportError, OSError):
        pass
for name in ("fcntl", "grp", "pty", "pwd", "resource", "termios", "tty"):
    sys.modules[name] = None
NAMES = """
chown fchmod fork geteuid getgid getpgid getuid killpg mkfifo nice O_NOFOLLOW O_NONBLOCK SCHED_FIFO SCHED_OTHER
SCHED_RESET_ON_FORK SCHED_RR sched_getaffinity sched_getscheduler sched_param sched_setaffinity sched_setscheduler
setpgid statvfs sysconf alarm pthread_kill pthread_sigmask setitimer sigwait SIGALRM SIGCONT SIGHUP SIGPIPE SIGQUIT
SIGSTOP SIGTSTP SIGUSR1 SIGUSR2 SIGWINCH SIGXCPU
"""
for module in (os, signal):
    for name in NAMES.split():
        if hasattr(module, name):
            delattr(module, name)
import json, livebass
for module in pkgutil.walk_packages(livebass.__path__, "livebass."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
from livebass.cli.main import handle_signals, leave, run
with handle_signals():
    for line in json.loads(sys.argv[1]):
        if status := run(line):
            sys.exit(status)
print("all ran")
leave(0)
'''
COMMANDS = [
    ("devices",), ("render", "--note", "E1", "--duration", "0.1", "--tail", "0", "-q", "live", "-o", "a.wav"),
    ("export", "instrument", "slap", "-o", "slap.lbass"), ("presets", "check", "slap"),
    ("simulate", "-q", "live", "--duration", "10ms", "-o", "pluck"),
    ("study", "sweep", "--vary", "pluck.apex=1mm:2mm:2", "--modes", "9", "--duration", "9ms", "-o", "d"),
]  # fmt: skip


def test_without_what_windows_lacks(tmp_path: Path) -> None:
    """In one process: importing the packages takes longer than the commands."""
    done = python(PROGRAM, json.dumps(COMMANDS), cwd=tmp_path, env={"JACK_DEFAULT_SERVER": "nobody"})
    assert done.returncode == 0 and done.stdout.endswith("all ran\n"), done.stderr
