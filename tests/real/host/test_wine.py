"""The Windows plugin under Wine: in our hosts it sounds like the Linux plugin and opens the same window."""

from __future__ import annotations

import itertools
import queue
import re
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.clap import Plugin
from support.jack import wait_for
from support.places import SUPPORT
from support.plugins import MAX_BYTES, PRESETS
from support.screen import LOWEST_STRING, SIZE, SLIDER, WholeScreen, hand, needs_screen, running_screen
from support.window import Window, different
from support.wine import PATIENCE, WINDOWS, needs_wine, place, program, run, running_wine

from livebass import load_preset
from livebass.plugin import build, clap, vst3
from livebass.plugin.systems import SYSTEMS as ALL
from livebass.plugin.systems import this_system

pytestmark = [
    pytest.mark.slow,  # its C compiles in test_systems.py; its sound and view are always tested on Linux
    pytest.mark.skipif(this_system().name != "linux-x86_64", reason="Wine runs what is for its own processor"),
]
LINUX = ALL["linux-x86_64"]
SYSTEMS = (LINUX, WINDOWS)
FILES = {"clap": dict.fromkeys((LINUX.name, WINDOWS.name), clap.BINARY), "vst3": vst3.BINARIES}  # in their bundles
GAIN = 0


@pytest.fixture(scope="module")
def wine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder with Windows programs, and a screen for them."""
    needs_wine()
    needs_screen()
    folder = tmp_path_factory.mktemp("wine")
    with running_screen(), running_wine(folder / "prefix"):
        yield folder


@pytest.fixture(scope="module")
def bundles(wine: Path) -> dict[str, Path]:
    """The plugins, by format and system."""
    basses, made = {name: load_preset(name) for name in PRESETS}, {}
    for form, system in itertools.product((clap, vst3), SYSTEMS):
        name = f"{form.__name__.rpartition('.')[2]}-{system.name}"
        form.write_bundle(basses, wine / name / "livebass", system)
        made[name] = wine / name / "livebass"
    return made


@pytest.fixture(scope="module")
def programs(wine: Path) -> dict[str, list[Any]]:
    """The hosts, as commands by name and system."""
    made: dict[str, list[Any]] = {"winhost": ["wine", program("winhost", wine)]}
    for name in ("claphost", "vst3host"):
        source, out = SUPPORT / f"{name}.c", wine / name
        command = [*build.compiler(LINUX), "-O1", f"-I{build.C}", source, "-o", out, "-lm", "-ldl", "-lpthread"]
        subprocess.run(command, check=True)
        made[f"{name}-{LINUX.name}"] = [out]
        made[f"{name}-{WINDOWS.name}"] = ["wine", program(name, wine)]
    return made


def test_the_binary_is_small_exports_its_entries_alone_and_needs_what_windows_has(bundles: dict[str, Path]) -> None:
    file = bundles[f"clap-{WINDOWS.name}"] / clap.BINARY
    assert file.stat().st_size < MAX_BYTES
    listed = run("objdump", "-p", file)
    exported = set(re.findall(r"^\s*\[ *\d+\] (?:\+base\[ *\d+\] +[0-9a-f]+ )?(\w+)$", listed, re.MULTILINE))
    assert exported == {"GetPluginFactory", "InitDll", "ExitDll", "clap_entry", "lv2_descriptor", "lv2ui_descriptor"}
    needed = set(re.findall(r"DLL Name: (\S+)", listed))
    parts = {name for name in needed if name.startswith("api-ms-win-crt-")}  # parts of the C library
    assert parts and needed - parts == {"ADVAPI32.dll", "GDI32.dll", "KERNEL32.dll", "SHELL32.dll", "USER32.dll"}
    assert all(word not in file.read_bytes() for word in (b"Py_", b"NRT_", b"numba"))


@pytest.mark.parametrize(("seed", "level"), [(2, LINUX.levels[-1]), (3, LINUX.levels[0])])  # odd: an output per string
@pytest.mark.parametrize("form", FILES)
def test_it_plays_what_the_plugin_of_linux_plays_bit_for_bit(
    bundles: dict[str, Path], programs: dict[str, list[Any]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    form: str, seed: int, level: str,
) -> None:  # fmt: skip
    """Random notes and automation, in CLAP events of every kind, other basses and states; on Windows with a window."""
    monkeypatch.setenv("LIVEBASS_LEVEL", level)
    sounds = []
    for system in SYSTEMS:
        out = tmp_path / f"{system.name}.raw"
        file = bundles[f"{form}-{system.name}"] / FILES[form][system.name]
        given: list[Any] = [file, 2, seed, *([0] if form == "clap" else []), out]
        if system == WINDOWS:
            given = [place(word) if isinstance(word, Path) else word for word in given] + ["window"]
        said = run(*programs[f"{form}host-{system.name}"], *given).split()
        assert int(said[0]) > 100 and 0 < float(said[-1]) < 1000
        sounds.append(out.read_bytes())
    assert len(sounds[0]) > 300_000 and sounds[0] == sounds[1]


class Host:
    """winhost: a Windows window in the corner of the screen, the actions in it and its reports."""

    def __init__(self, program: list[Any], plugin: Path, *scale: object) -> None:
        command = [*program, place(plugin / clap.BINARY), *map(str, scale)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout
        for line in self._process.stdout:
            self._lines.put(line.strip())

    def until(self, wanted: str) -> list[str]:
        """The lines from now until one begins with `wanted`."""
        found: list[str] = []
        while not (found and found[-1].startswith(wanted)):
            found.append(self._lines.get(timeout=PATIENCE))
        return found

    def say(self, line: str) -> None:
        assert self._process.stdin
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()

    def close(self) -> None:
        """Ends it; it must exit cleanly."""
        assert self._process.stdin
        self._process.stdin.close()
        try:
            self._process.wait(PATIENCE)
        finally:
            self._process.kill()
            self._process.wait()
            self._reader.join()
        assert self._process.returncode == 0


@contextmanager
def of_system(scale: float, theme: str) -> Iterator[None]:
    """Makes Windows use this scale and theme."""
    themes = r"HKCU\Software\Microsoft\Windows\CurrentVersion\Themes\Personalize"
    values = (
        (r"HKCU\Control Panel\Desktop", "LogPixels", round(96 * scale)),
        (themes, "AppsUseLightTheme", int(theme == "light")),
    )
    for key, name, value in values:
        run("wine", "reg", "add", key, "/v", name, "/t", "REG_DWORD", "/d", value, "/f")
    yield
    for key, name, _ in values:
        run("wine", "reg", "delete", key, "/v", name, "/f")


def seen_on_linux(folder: Path, scale: float, theme: str) -> Any:
    """The picture of the window on Linux, with the pointer outside."""
    hand("mousemove", *(side - 1 for side in SIZE))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIVEBASS_THEME", theme)
        with closing(Plugin(folder)) as plugin, closing(Window(plugin, scale)) as window:
            plugin.block(512)
            time.sleep(0.5)
            return window.picture()


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_its_window_is_that_of_linux_and_takes_a_hand(
    bundles: dict[str, Path], programs: dict[str, list[Any]], scale: float, theme: str
) -> None:
    """At the system's scale and theme; pressing a string sounds it, a slider tells the host."""
    expected = seen_on_linux(bundles[f"clap-{LINUX.name}"], scale, theme)
    height, width, _ = expected.shape
    with (
        of_system(scale, theme),
        closing(WholeScreen()) as screen,
        closing(Host(programs["winhost"], bundles[f"clap-{WINDOWS.name}"])) as host,
    ):
        assert host.until("open")[-1] == f"open {width} {height}"
        wait_for(lambda: different(screen.picture(width, height), expected) < 50)
        hand("mousemove", *(scale * x for x in LOWEST_STRING), "mousedown", 1)
        host.until("loud")
        wait_for(lambda: different(screen.picture(width, height), expected) > 300)
        hand("mouseup", 1)
        x, y = (scale * at for at in SLIDER)
        hand("mousemove", x, y, "mousedown", 1)
        for step in (10, 20, 30):
            hand("mousemove", x + scale * step, y)
        hand("mouseup", 1)
        reported = [line.split() for line in host.until(f"end {GAIN}")]
        begin, *moves, end = [words for words in reported if words[1:2] == [str(GAIN)]]
        assert begin[0] == "begin" and end[0] == "end" and {words[0] for words in moves} == {"value"}
        values = [float(words[2]) for words in moves]
        assert len(values) > 1 and values == sorted(values) and -60 < values[0] < values[-1] < -1


def test_it_is_resized_and_opened_again(bundles: dict[str, Path], programs: dict[str, list[Any]]) -> None:
    """By the host's scale; nothing is drawn outside the plugin's window."""
    with (
        closing(WholeScreen()) as screen,
        closing(Host(programs["winhost"], bundles[f"clap-{WINDOWS.name}"], 1)) as host,
    ):
        assert host.until("open")[-1] == "open 900 460"
        host.say("size 1200 600")
        assert host.until("open")[-1] == "open 1200 600"
        wait_for(lambda: len(np.unique(screen.picture(1200, 600)[460:].reshape(-1, 3), axis=0)) > 20)
        host.say("size 10 10")
        host.say("again")
        assert host.until("open")[-2:] == ["closed", "open 900 460"]
        wait_for(lambda: len(np.unique(screen.picture(900, 460).reshape(-1, 3), axis=0)) > 50)
