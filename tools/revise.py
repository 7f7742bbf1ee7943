"""Gives presets that have changed a new revision: .venv/bin/python tools/revise.py [--since REVISION-OF-GIT]

The present values become the preset's next revision, and presets/revisions.json gets the values of the one before,
which it reads from git, by default from the last commit. Presets without a sound of their own that is new (comments,
descriptions) keep their revision. A new preset begins with 1.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from livebass.preset import revisions
from livebass.preset.like import whole
from livebass.preset.load import LABORATORY, laboratory_names, preset_names, preset_tables
from livebass.preset.source import decode, parse, shipped_folder

ROOT = Path(__file__).resolve().parents[1]


def tables_in(folder: Path, name: str) -> dict[str, Any]:
    """The whole tables of a preset in a folder of presets."""

    def read(preset: str) -> tuple[str, dict[str, Any]]:
        place = folder / f"{preset}.toml"
        place = place if place.is_file() else folder / LABORATORY / place.name
        return place.name, parse(place.name, decode(place.name, place.read_bytes(), "preset"), "preset", "keys")

    label, own = read(name)
    return whole(label, own, read)


def extracted(since: str, folder: Path) -> Path:
    """The folder of the presets as they were in a revision of git."""
    archive = subprocess.run(["git", "archive", since, "presets"], cwd=ROOT, capture_output=True, check=True).stdout
    subprocess.run(["tar", "-x", "-C", folder], input=archive, check=True)
    return folder / "presets"


def revised(kept: dict[str, Any], before: Path, names: list[str]) -> list[str]:
    """Gives changed presets of `kept`, the file's content, a new revision; returns what was done, in lines."""
    said = []
    for name in names:
        tables = preset_tables(name)[1]
        digest, own = revisions.digest(tables), kept.get(name)
        if own is None:
            kept[name] = {"revision": 1, "digest": digest}
            said.append(f"{name}@1")
        elif own["digest"] != digest:
            old = tables_in(before, name)
            if revisions.digest(old) != own["digest"]:
                raise SystemExit(
                    f"{name}: is not as its revision {own['revision']} there: name the commit with --since"
                )
            changed = revisions.changes(old, tables)
            earlier = own.get("before", {}) | {str(own["revision"]): {"digest": own["digest"], "changed": changed}}
            kept[name] = {"revision": own["revision"] + 1, "digest": digest, "before": earlier}
            said.append(f"{name}@{own['revision'] + 1}: {', '.join(changed)}")
    return said


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--since", default="HEAD")
    options = parser.parse_args()
    file = shipped_folder() / revisions.FILE
    kept = json.loads(file.read_text("utf-8")) if file.is_file() else {}
    with tempfile.TemporaryDirectory() as folder:
        said = revised(kept, extracted(options.since, Path(folder)), preset_names() + laboratory_names())
    file.write_text(json.dumps(dict(sorted(kept.items())), indent=1, ensure_ascii=False) + "\n", "utf-8")
    print("\n".join(said) or "no preset has changed")


if __name__ == "__main__":
    main()
