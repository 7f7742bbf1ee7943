"""Keeps files of this version that every later one must open: .venv/bin/python tools/keep.py [--api]

Writes tests/kept/VERSION: a project's state in each plugin format, a take, a preset, a key map, a sound, a link, the
settings of `play` and an instrument file, with digests of what they sound like. tests/promises/test_kept.py opens all
of them. Run it for each release; it replaces the folder of the same version. With --api it only lists the public
interface of Python, in tests/kept/api.txt, which tests/promises/test_interface.py compares.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT)]

from support import interface, kept_files  # noqa: E402

from livebass import __version__  # noqa: E402
from livebass.files.formats import SOUND  # noqa: E402

OTHER = "--sounds"  # prints only the sounds of this level
API = "--api"  # lists only the public interface


def digests(folder: Path) -> dict[str, Any]:
    with closing(kept_files.Opened(folder)) as opened:
        return opened.digests()


def main() -> None:
    folder = ROOT / "tests" / "kept" / __version__
    if OTHER in sys.argv:
        print(json.dumps(digests(folder)["sounds"]))
        return
    (folder.parent / "api.txt").write_text(interface.public_lines(), "utf-8")
    if API in sys.argv:
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, data in kept_files.make_files().items():
        (folder / name).write_bytes(data)
    found = digests(folder) | {"sound": SOUND}
    for level in ("x86-64-v2",):  # an older processor's sounds, too
        command = [sys.executable, __file__, OTHER]
        reported = subprocess.run(command, env=os.environ | {"LIVEBASS_LEVEL": level}, capture_output=True, check=True)
        found["sounds"] |= json.loads(reported.stdout.splitlines()[-1])
    (folder / kept_files.DIGESTS).write_text(json.dumps(found, indent=1) + "\n", "utf-8")
    file = folder.parent / kept_files.SOUNDS
    sounds = json.loads(file.read_text("utf-8")) if file.is_file() else {}
    if sounds.setdefault(str(SOUND), kept_files.sounds_digest()) != kept_files.sounds_digest():
        raise SystemExit(f"the pinned sounds are not those of sound {SOUND}: raise SOUND in livebass/files/formats.py")
    file.write_text(json.dumps(sounds, indent=1) + "\n", "utf-8")
    print(f"{folder}: {', '.join(sorted(file.name for file in folder.iterdir()))}")


if __name__ == "__main__":
    main()
