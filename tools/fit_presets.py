"""Makes the shipped presets that are fitted to recordings, by `livebass fit`.

    python tools/fit_presets.py FOLDER [PRESET...]

FOLDER holds the recordings, as for tools/real_notes.py; tools/fits.toml says which make which preset, and how. What a
fit leaves, its trials and its page, stays in FOLDER: after an interruption the same command goes on. The same kind of
processor makes the same presets.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
PRESETS = HERE.parent / "presets"


def fitted(folder: Path, name: str, told: dict[str, Any]) -> str:
    """Fits a preset to its recordings and returns its text."""
    place = folder / f"{name}.toml"
    given = [f"--{key}={told[key]}" for key in ("like", "seed", "evaluations")]
    command = [sys.executable, "-m", "livebass", "fit", folder / told["recordings"], *given, "-o", place]
    subprocess.run(command, check=True)
    return place.read_text(encoding="utf-8")


def shipped(text: str, told: dict[str, Any], source: dict[str, Any]) -> str:
    """The text of the shipped preset: of a fit, with its name, its source and the keys that are set by hand."""
    for word, for_others in (("your own second take", "a second take of it"), ("your bass", "that bass")):
        text = text.replace(word, for_others)
    given = {key: told[key] for key in ("name", "description")} | told["by_hand"]
    for key, value in given.items():
        line = f"{key} = " + (f'"{value}"' if isinstance(value, str) else str(value))
        line += "  # by hand" if key in told["by_hand"] else ""
        text, count = re.subn(rf"^{key} = .*$", line, text, count=1, flags=re.MULTILINE)
        if not count:
            raise SystemExit(f"{key}: not in the fitted preset")
    return f"# {source['bass']}: {source['source']},\n# {told['notes']}.\n# {told['why']}\n{text}"


def main() -> None:
    """Writes presets/PRESET.toml for each preset."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    fits = tomllib.loads((HERE / "fits.toml").read_text(encoding="utf-8"))
    sources = tomllib.loads((HERE / "real_notes.toml").read_text(encoding="utf-8"))
    parser.add_argument("presets", nargs="*", choices=[[], *fits], metavar="PRESET")
    given = parser.parse_args()
    for name in given.presets or fits:
        told = fits[name]
        text = shipped(fitted(given.folder, name, told), told, sources[told["recordings"]])
        (PRESETS / f"{name}.toml").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
