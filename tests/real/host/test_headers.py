"""The LV2 interface in our words (plugin/c/abi/lv2.h) beside the official headers, which Debian's lv2-dev brings.

No package brings those of CLAP and VST3.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from support.needs import missing, tool

from livebass.plugin import build

HEADERS = ("core/lv2", "atom/atom", "log/log", "midi/midi", "state/state", "ui/ui", "urid/urid", "worker/worker")
# Ours, the official one, and its members in the order of ours
STRUCTS = (
    ("lv2_feature", "LV2_Feature", "URI data"),
    ("lv2_plugin", "LV2_Descriptor", "URI instantiate connect_port activate run deactivate cleanup extension_data"),
    ("lv2_map", "LV2_URID_Map", "handle map"),
    ("lv2_log", "LV2_Log_Log", "handle printf"),
    ("lv2_atom", "LV2_Atom", "size type"),
    ("lv2_sequence", "LV2_Atom_Sequence", "atom body.unit body.pad"),
    ("lv2_event", "LV2_Atom_Event", "time.frames body"),
    ("lv2_ui", "LV2UI_Descriptor", "URI instantiate cleanup port_event extension_data"),
    ("lv2_ui_idle", "LV2UI_Idle_Interface", "idle"),
    ("lv2_ui_resize", "LV2UI_Resize", "handle ui_resize"),
    ("lv2_ui_touch", "LV2UI_Touch", "handle touch"),
    ("lv2_schedule", "LV2_Worker_Schedule", "handle schedule_work"),
    ("lv2_worker", "LV2_Worker_Interface", "work work_response end_run"),
    ("lv2_state", "LV2_State_Interface", "save restore"),
)
NUMBERS = (
    ("LV2_SUCCESS", "LV2_WORKER_SUCCESS"), ("LV2_UNKNOWN", "LV2_WORKER_ERR_UNKNOWN"),
    ("LV2_SUCCESS", "LV2_STATE_SUCCESS"), ("LV2_UNKNOWN", "LV2_STATE_ERR_UNKNOWN"),
    ("LV2_PLAIN", "(LV2_STATE_IS_POD | LV2_STATE_IS_PORTABLE)"), ("LV2_NO_PROPERTY", "LV2_STATE_ERR_NO_PROPERTY"),
)  # fmt: skip
BEGINNINGS = {"lv2_log"}  # from the host, which has more behind them
OF_ARDOUR = {"lv2_midnam", "lv2_midnam_host"}  # not of LV2


def members(name: str, header: str) -> list[str]:
    """The members of one of our structs, in order."""
    body = re.search(r"typedef struct \w*\s*\{([^}]*)\} " + name + ";", header)
    assert body, name
    lines = re.sub(r"/\*.*?\*/", "", body[1], flags=re.DOTALL).split(";")[:-1]
    found = [re.findall(r"\(\*(\w+)\)\(", line) or re.findall(r"(\w+)(?=,|$)", line.strip()) for line in lines]
    return [member for each in found for member in each]


def test_layouts_numbers_and_addresses_are_those_of_the_official_headers(tmp_path: Path) -> None:
    if not Path("/usr/include/lv2/core/lv2.h").exists():
        missing("LV2's headers", "lv2-dev", "LV2")
    ours = (build.C / "abi/lv2.h").read_text()
    assert {name for name, *_ in STRUCTS} | OF_ARDOUR == set(re.findall(r"^\} (\w+);", ours, re.MULTILINE))
    lines = [f"#include <lv2/{name}.h>" for name in HEADERS] + ['#include "abi/lv2.h"']
    for name, official, text in STRUCTS:
        pairs = list(zip(members(name, ours), text.split(), strict=True))
        sizes = f"sizeof({name}) {'<' if name in BEGINNINGS else '=='} sizeof({official})"
        lines.append(f'_Static_assert({sizes}, "{name}");')
        for own, other in pairs:
            same = f"offsetof({name}, {own}) == offsetof({official}, {other})"
            size = f"sizeof((({name} *)0)->{own}) == sizeof((({official} *)0)->{other})"
            lines.append(f'_Static_assert({same} && {size}, "{name}.{own}");')
    lines += [f'_Static_assert({own} == (int){other}, "{own}");' for own, other in NUMBERS]
    addresses = dict(re.findall(r'#define (LV2_\w+) "(http://lv2plug[^"]*)"', ours))
    official_text = "\n".join(Path(f"/usr/include/lv2/{name}.h").read_text() for name in HEADERS)
    assert addresses and all(
        f"<{each}>" in official_text or f" {each}\n" in official_text for each in addresses.values()
    )
    source = tmp_path / "same.c"
    source.write_text("\n".join(lines) + "\n")
    subprocess.run([tool("cc"), "-std=gnu11", "-fsyntax-only", f"-I{build.C}", source], check=True)
