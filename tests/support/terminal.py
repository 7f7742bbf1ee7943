"""`livebass` in a terminal, with a keyboard."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import subprocess
import sys
import termios
import time
from typing import Any

from support.jack import PATIENCE


class InTerminal:
    """`livebass play` in a pseudo terminal of a given width, with a keyboard."""

    def __init__(self, *arguments: object, columns: int = 100, shell: bool = False) -> None:
        self.ours, theirs = pty.openpty()
        termios.tcsetwinsize(self.ours, (24, columns))
        command = [sys.executable, "-m", "livebass", *map(str, arguments)]
        if shell:
            command = ["sh", "-i"]
        ends = {"stdin": theirs, "stdout": theirs, "stderr": theirs}
        self.process = subprocess.Popen(command, preexec_fn=self._own(theirs), **ends)  # type: ignore[call-overload]
        os.close(theirs)
        self.shown = ""

    @staticmethod
    def _own(fd: int) -> Any:
        def make() -> None:
            os.setsid()
            fcntl.ioctl(fd, termios.TIOCSCTTY, 0)

        return make

    def wait(self, text: str, seconds: float = PATIENCE, times: int = 1) -> None:
        """Waits until `text` was shown `times` times or, for "", until the program ends."""
        end = time.monotonic() + seconds
        while not text or self.shown.count(text) < times:
            assert time.monotonic() < end, self.shown
            if select.select([self.ours], [], [], 0.1)[0]:
                try:
                    more = os.read(self.ours, 65536)
                except OSError:
                    more = b""
                if not more:
                    assert not text, self.shown
                    return
                self.shown += more.decode()
            elif not text and self.process.poll() is not None:
                return

    def type(self, keys: str) -> None:
        os.write(self.ours, keys.encode())

    @property
    def cooked(self) -> bool:
        flags = termios.tcgetattr(self.ours)[3]
        return bool(flags & termios.ICANON and flags & termios.ECHO)

    def close(self) -> None:
        self.process.kill()
        self.process.wait(10)
        os.close(self.ours)
