"""Parallel strings, and the window, under ThreadSanitizer and AddressSanitizer: the plugins' C, and kernels from IR.

ziglang's clang instruments both; it has ThreadSanitizer's library, and gcc has AddressSanitizer's.
"""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from functools import cache
from pathlib import Path

import pytest
from support.places import SUPPORT
from support.screen import LOWEST_STRING, SLIDER, Screen, hand, needs_screen, running_screen

from livebass import load_preset
from livebass.compiling import emitter
from livebass.plugin import build
from livebass.plugin.header import header, suffix
from livebass.plugin.instrument import write_instrument
from livebass.plugin.systems import this_system

LEVEL, OTHER = "x86-64-v2", "x86-64-v3"
BASSES = ("slap", "five-string")
KINDS = ("thread", "address")
BLOCKS = 160
LEVELS = f"-Dkernels{suffix(OTHER)}=kernels{suffix(LEVEL)}"
FLAGS = ("-g", "-O1", "-ffp-contract=off", "-DWITHIN", "-DLB_CHECK_THREADS", LEVELS)

pytestmark = [
    pytest.mark.slow,  # tests/unit/live/test_helpers.py and tests/unit/live/test_team.py always run
    pytest.mark.skipif(
        this_system().name != "linux-x86_64" or not importlib.util.find_spec("ziglang") or not shutil.which("gcc"),
        reason="needs ziglang, and gcc on Linux",
    ),
]


@cache
def program() -> str:
    """The kernels' IR."""
    text = re.sub(r"@lb_(\w+)", rf"@lb_\1{suffix(LEVEL)}", emitter.program())
    return str(emitter.parse_ir(text, LEVEL)[1])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the kernels' header and with instruments."""
    made = tmp_path_factory.mktemp("sanitizers")
    (made / "kernels.h").write_text(header([LEVEL]))
    for name in BASSES:
        write_instrument(load_preset(name), made / f"{name}.lbass")
    (made / "instruments.txt").write_text("\n".join(BASSES) + "\n")
    return made


def run(*command: object) -> str:
    first = os.environ | {"TSAN_OPTIONS": f"halt_on_error=1:suppressions={SUPPORT / 'xlib.supp'}"}
    done = subprocess.run([*map(str, command)], env=first, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:3000]
    return done.stdout


def built(folder: Path, kind: str, host: str, text: str, name: str = "") -> Path:
    """Builds a host with the plugin's C and the kernels `text`, all under a sanitizer."""
    made, code = folder / f"{host}-{kind}{name}", folder / f"{kind}{name}.o"
    zig = build.zig(this_system())
    if not code.exists():
        checked = re.sub(r"^(define [^\n]*\)[^\n{]*)\{", rf"\1 sanitize_{kind} {{", text, flags=re.MULTILINE)
        (folder / f"{kind}.ll").write_text(checked)
        cpu = f"-mcpu={LEVEL.replace('-', '_')}"
        run(*zig, f"-fsanitize={kind}", "-O2", "-Wno-override-module", cpu, "-c", folder / f"{kind}.ll", "-o", code)
    sources = [*sorted(build.C.rglob("*.c")), SUPPORT / f"{host}.c"]
    compiler = zig if kind == "thread" else ["gcc"]
    where = (f"-I{folder}", f"-I{build.C}")
    run(*compiler, f"-fsanitize={kind}", *FLAGS, *where, *sources, code, "-o", made, "-lm", "-lpthread")
    return made


def team(host: Path, folder: Path, blocks: int, helpers: int, rests: int = 0) -> tuple[int, str]:
    """Plays; returns the number of strings played by helpers, and the checksum of the sound."""
    helped, checksum = run(host, *(folder / f"{name}.lbass" for name in BASSES), blocks, 1, helpers, rests).split()
    return int(helped), checksum


@pytest.mark.parametrize("kind", KINDS)
def test_threads_beside_the_audio_thread(folder: Path, kind: str) -> None:
    """They come and go, rest before strings, and meet changed and reset basses."""
    host = built(folder, kind, "teamhost", program())
    nobody, alone = team(host, folder, BLOCKS, 0)
    assert nobody == 0
    for helpers, rests in ((1, 0), (3, 0), (5, 300)):
        helped, checksum = team(host, folder, BLOCKS, helpers, rests)
        assert helped > BLOCKS // 3 and checksum == alone, (helpers, rests)


@pytest.mark.parametrize("kind", KINDS)
def test_threads_of_a_host_and_of_the_plugin_itself(folder: Path, kind: str) -> None:
    host = built(folder, kind, "claphost", program())
    for seed, pool in ((1, 0), (2, 3)):
        blocks, _, greatest = run(host, folder / "livebass.clap", 3, seed, pool).split()
        assert int(blocks) > 100 and 0 < float(greatest) < 1000


@pytest.mark.parametrize("kind", KINDS)
def test_a_window_that_is_opened_and_pressed_meanwhile(folder: Path, kind: str) -> None:
    """Beside random events, automation, states and changes of bass; Xlib's internals are not checked."""
    needs_screen()
    host = built(folder, kind, "claphost", program())
    with running_screen(), closing(Screen(900, 500)) as screen, ThreadPoolExecutor(1) as beside:
        playing = beside.submit(run, host, folder / "livebass.clap", 6, 3, 0, "-", screen.window)
        presses = 0
        while not playing.done():
            page = presses % 4
            hand("mousemove", 58 + 84 * page, 58, "click", 1, "mousemove", *LOWEST_STRING, "click", 1)
            hand("mousemove", *SLIDER, "mousedown", 1, "mousemove", SLIDER[0] + 40, SLIDER[1], "mouseup", 1)
            hand("mousemove", 872 - 26 * (presses % 2), 59, "click", 1)  # B, A
            if page == 2:  # the first cabinet, or none
                hand("mousemove", 600, 440, "click", 1, "sleep", 0.2)
                hand("mousemove", 620, 365 + presses % 8 * 5, "click", 1)
            if page == 3:  # saves a sound, opens the list and loads one; undoes both
                hand("mousemove", 474, 23, "click", 1, "click", 1, "mousemove", 280, 23, "click", 1, "sleep", 0.2)
                hand("mousemove", 300, 113, "click", 1, "mousemove", 754, 59, "click", 1, "click", 1)
            presses += 1
        blocks, _, greatest = playing.result().split()
    assert presses > 3 and int(blocks) > 500 and 0 < float(greatest) < 1000


def test_a_race_would_be_found(folder: Path) -> None:
    """With no ordering between the helpers' data and their completion flags."""
    careless, count = re.subn(r"(cmpxchg .*) acq_rel acquire", r"\1 monotonic monotonic", program())
    assert count == 3
    host = built(folder, "thread", "teamhost", careless, "-careless")
    with pytest.raises(AssertionError, match=r"data race[\s\S]* lb_play"):
        team(host, folder, 60, 3)
