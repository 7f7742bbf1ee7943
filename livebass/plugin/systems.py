"""The systems that release wheels and plugins are built for, and where their hosts look for plugins."""

from __future__ import annotations

import os
import platform
import sys
from dataclasses import dataclass
from pathlib import Path

from livebass.compiling import ARM, X86, emitter


@dataclass(frozen=True)
class System:
    """An operating system on a kind of processor."""

    name: str
    triple: str  # LLVM's name
    zig: str  # ziglang's
    wheel: str  # platform tag of a wheel
    machine: str  # kind of processor, of emitter.LEVELS
    ending: str  # extension of shared libraries

    @property
    def levels(self) -> list[str]:
        """The processor levels, lowest first."""
        return [name for name, level in emitter.LEVELS.items() if level.machine == self.machine]


SYSTEMS = {
    system.name: system
    for system in (
        System(
            "linux-x86_64", "x86_64-unknown-linux-gnu", "x86_64-linux-gnu.2.17", "manylinux_2_17_x86_64", "x86_64", "so"
        ),
        System(
            "linux-aarch64", "aarch64-unknown-linux-gnu", "aarch64-linux-gnu.2.17", "manylinux_2_17_aarch64",
            "aarch64", "so",
        ),
        System(
            "macos-x86_64", "x86_64-apple-macosx11.0.0", "x86_64-macos.11.0", "macosx_11_0_x86_64", "x86_64", "dylib"
        ),
        System(
            "macos-arm64", "arm64-apple-macosx11.0.0", "aarch64-macos.11.0", "macosx_11_0_arm64", "aarch64", "dylib"
        ),
        System("windows-x86_64", "x86_64-w64-windows-gnu", "x86_64-windows-gnu", "win_amd64", "x86_64", "dll"),
    )
}  # fmt: skip
OPERATING = {"linux": "linux", "darwin": "macos", "win32": "windows"}  # by sys.platform
VST3_PRESETS = "vst3 presets"  # the makers' folders of presets for VST3 plugins, in place of a format
FOLDERS = {  # the user's plugin folders, by the first part of a system's name and by format
    "linux": {"lv2": "~/.lv2", "clap": "~/.clap", "vst3": "~/.vst3", VST3_PRESETS: "~/.vst3/presets/livebass"},
    "macos": {kind: f"~/Library/Audio/Plug-Ins/{kind.upper()}" for kind in ("lv2", "clap", "vst3")}
    | {VST3_PRESETS: "~/Library/Audio/Presets/livebass"},
    "windows": {
        "lv2": r"%APPDATA%\LV2",
        "clap": r"%LOCALAPPDATA%\Programs\Common\CLAP",
        "vst3": r"%LOCALAPPDATA%\Programs\Common\VST3",
        VST3_PRESETS: r"%USERPROFILE%\Documents\VST3 Presets\livebass",
    },
}


def this_system() -> System:
    """Returns the system of this process. Raises ValueError if no plugins are built for it."""
    machine = platform.machine().lower()
    kind = "x86_64" if machine in X86 else "aarch64" if machine in ARM else machine
    operating = OPERATING.get(sys.platform, sys.platform)
    for system in SYSTEMS.values():
        if system.machine == kind and system.name.startswith(f"{operating}-"):
            return system
    raise ValueError(f"there are no plugins for {operating} on {kind}, only for {', '.join(SYSTEMS)}")


def folder_of_plugins(system: System, kind: str) -> str:
    """Returns the user folder where hosts on `system` look for plugins of a format, in that system's notation."""
    return FOLDERS[system.name.partition("-")[0]][kind]


def own_folder_of_plugins(kind: str) -> Path:
    """Returns the folder of this user where hosts on this system look for plugins of a format. Raises OSError."""
    written = folder_of_plugins(this_system(), kind)
    found = os.path.expanduser(os.path.expandvars(written))
    if not os.path.isabs(found):
        raise OSError(f"{written}: the variable it begins with is not set")
    return Path(found)
