"""The plugins' C has layers: a file includes and calls only lower ones, and nothing is circular."""

from __future__ import annotations

import graphlib
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from livebass.plugin import build

# From lowest to highest; files of one layer do not call each other.
LAYERS = (
    {"thread", "files", "paint", "retuning", "library_win32"},
    {"response", "names"},
    {"core", "look", "drawing"},  # basses and synths; the windows' view of them
    {"values", "neck", "crowns"},
    {"learn", "layout", "vst3_midi"},
    {"notes", "state", "parts"},
    {"text", "menu", "hand"},
    {"score"},
    {"song"},
    {"sounds", "session", "picture"},
    {"instance", "window"},  # all that a shell needs
    {"editor"},
    {"vst3_view", "loader"},
    {"clap", "lv2", "lv2_ui", "vst3"},  # the shells: none knows another
)
WINDOWS = {"window/x11.c", "window/win32.c", "window/cocoa.c"}
FOLDERS = ("abi", "system", "instance", "picture", "window", "shells")  # from the ground up
COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
DEFINED = re.compile(
    r"^(?!static|extern|typedef)[A-Za-z_][\w *]*?(lb_\w+)(?:\[\w*\])*(?:\([^;]*?\) \{| = )", re.MULTILINE
)
Files = Mapping[str, str]


@pytest.fixture(scope="module")
def files() -> Files:
    """The text of each file by place, without comments."""
    return {file.relative_to(build.C).as_posix(): COMMENT.sub("", file.read_text()) for file in build.C.rglob("*.[ch]")}


def room(file: str) -> str:
    """The layer name of a file: the windows of three systems share one."""
    return "window" if file in WINDOWS else Path(file).stem


def definers(files: Files) -> dict[str, str]:
    return {name: room(file) for file, text in files.items() if file.endswith(".c") for name in DEFINED.findall(text)}


def calls(files: Files) -> Iterator[tuple[str, str, str]]:
    """(caller, called, name of the callee), between different rooms."""
    defined = definers(files)
    for file, text in files.items():
        for name in re.findall(r"\blb_\w+", text):
            if file.endswith(".c") and name in defined and defined[name] != room(file):
                yield room(file), defined[name], name


def broken_calls(files: Files) -> set[tuple[str, str, str]]:
    """Calls that do not go down."""
    layer = {name: number for number, names in enumerate(LAYERS) for name in names}
    return {call for call in calls(files) if layer[call[0]] <= layer[call[1]]}


def test_each_file_has_its_layer(files: Files) -> None:
    rooms = {room(file) for file in files if file.endswith(".c")}
    assert rooms - {"page"} == set().union(*LAYERS) - {"page"}


def test_calls_go_down(files: Files) -> None:
    assert {"lb_value", "lb_load_bass", "lb_draw_neck", "lb_kinds", "lb_edit_instance"} <= definers(files).keys()
    assert broken_calls(files) == set()


def test_a_circle_would_be_found(files: Files) -> None:
    """Such as the former circles of picture and neck, and of instance and state."""
    wrong = {
        **files,
        "picture/neck.c": files["picture/neck.c"] + "lb_draw(p);",
        "instance/state.c": files["instance/state.c"] + "lb_serve(i);",
    }
    assert broken_calls(wrong) == {("neck", "picture", "lb_draw"), ("state", "instance", "lb_serve")}


def test_includes_have_no_circle(files: Files) -> None:
    included = {file: set(re.findall(r'#include "(.*?)"', text)) for file, text in files.items()}
    order = list(graphlib.TopologicalSorter(included).static_order())
    assert order.index("instance/core.h") < order.index("instance/instance.h") < order.index("shells/clap.c")


def test_folders_include_lower_ones(files: Files) -> None:
    floor = {folder: number for number, folder in enumerate(FOLDERS)}
    for file, text in files.items():
        for included in re.findall(r'#include "(\w+)/', text):
            assert floor[included] <= floor[file.split("/")[0]], (file, included)


def test_the_picture_knows_no_host(files: Files) -> None:
    """Nor an instance: it draws the data of its face."""
    picture = ("drawing", "layout", "menu", "neck", "crowns", "parts", "picture", "paint")
    assert {called for caller, called, _ in calls(files) if caller in picture} <= {*picture, "look"}
