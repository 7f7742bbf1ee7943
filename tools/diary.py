"""Runs README's commands in their order, as a newcomer would, and prints the last line of each.

python tools/diary.py [--first]     all commands, or only the set-up and the first steps

It goes to a fresh clone, and changes it. A command ends well with status 0, or with one line of error that names what
is missing here, such as a sound card. Those that play until Ctrl-C get it after some seconds. Exits with 1 if a
command ends otherwise.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
OURS = re.compile(r"(\.venv/bin/)?(livebass|pip|python)\b|tools/\w+")
LASTING = ("play", "page")  # they run until Ctrl-C
PLAYED = 12.0  # s until then
ENDED, LONGEST = 60.0, 1800.0  # s in which a command ends after Ctrl-C; for another one
LEFT_OUT = {  # what looks like a command, and why nobody runs it here
    "tools/wheel": "half an hour: tests/real/programs/test_wheel.py",
    "livebass simulate": "the name of a command, explained further down",
    "livebass help PAGE": "a placeholder",
    "livebass COMMAND --help": "a placeholder",
}
MISSING = re.compile(r"livebass: error: .*(install|no output|no server|not found|no browser|needs|there is none)")
STATUS = {"livebass study claims": 1}  # README says that one statement fails


def commands(text: str) -> list[list[str]]:
    """Returns the shell commands of a text in Markdown, by block: fenced ones, and those in one table or paragraph."""
    blocks = []
    for block in re.split(r"(```sh\n.*?```)", text, flags=re.DOTALL):
        if block.startswith("```"):
            lines = [line.split(" #")[0].strip() for line in block.splitlines()[1:-1]]
        else:
            lines = re.findall(r"`([^`\n]+)`", block)
        found = [line for line in lines if (OURS.match(line) and " " in line) or line in ("tools/demo", "tools/test")]
        if found:
            blocks.append(found)
    return blocks


def run(command: str, environment: dict[str, str]) -> tuple[int, str]:
    """Runs a command in the clone; returns its status and its last line."""
    words = shlex.split(command)
    lasts = "livebass" in words[0] and words[1] in LASTING
    with subprocess.Popen(
        ["bash", "-c", f"exec {command}"], cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, errors="replace", start_new_session=True,
    ) as process:  # fmt: skip
        try:
            if lasts:
                end = time.monotonic() + PLAYED
                while process.poll() is None and time.monotonic() < end:
                    time.sleep(0.1)
                if process.poll() is None:
                    os.killpg(process.pid, signal.SIGINT)
            words = process.communicate(timeout=ENDED if lasts else LONGEST)[0].strip().splitlines()
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            return 124, f"did not end within {ENDED:g} s of Ctrl-C" if lasts else f"ran longer than {LONGEST:g} s"
    return process.returncode, words[-1] if words else ""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", action="store_true", help="only the first three blocks, without the tests")
    given = parser.parse_args()
    blocks = commands(README.read_text(encoding="utf-8"))
    if given.first:
        blocks = [[line for line in block if line != "tools/test"] for block in blocks[:3]]
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job of a shell would ignore it
    environment = {**os.environ, "PATH": f"{ROOT}/.venv/bin{os.pathsep}{os.environ['PATH']}"}
    failed = 0
    for command in dict.fromkeys(line for block in blocks for line in block):
        if why := LEFT_OUT.get(command):
            print(f"  -      {command}\n         left out: {why}", flush=True)
            continue
        before = time.monotonic()
        status, line = run(command, environment)
        fine = status in (0, 130, STATUS.get(command)) or (status in (1, 2) and bool(MISSING.match(line)))
        failed += not fine
        took = time.monotonic() - before
        print(f"{status:3d} {'  ' if fine else 'NO'} {command}  [{took:.0f} s]\n         {line}", flush=True)
    print(f"{failed} commands failed" if failed else "every command ended well")
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
