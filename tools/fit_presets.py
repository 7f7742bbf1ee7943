"""Makes the shipped presets that are fitted to recordings, by `livebass fit`.

    python tools/fit_presets.py FOLDER [PRESET...]

FOLDER holds the recordings, as for tools/real_notes.py; tools/fits.toml says which make which preset, and how. What a
fit leaves, its trials and its page, stays in FOLDER: after an interruption the same command goes on. The same kind of
processor makes the same presets. A preset whose fit begins at a file of tools/bases is that file with fitted numbers.
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
TABLE = re.compile(r"^(?=\[)", re.MULTILINE)  # where a table begins
HEADER = re.compile(r"(?:\[.*\n(?:name = .*)?)?")  # with the name of a string
KEY = r"^{} = (?:\{{[^}}]*\}}|[^\n{{]*).*$"  # and its value, on several lines if it is a table in braces
END = re.compile(r"\n(?=(?:\s|#.*\n)*\Z)")  # of the last key of a table; comments below it are about the next
VALUE = re.compile(r"^(\w+) = .*$", re.MULTILINE)  # in a fitted preset


def tables(text: str) -> dict[tuple[str, int], str]:
    """The texts of a preset's tables by header, with a name, and number; what stands above them comes first."""
    found: dict[tuple[str, int], str] = {}
    for part in TABLE.split(text):
        header = HEADER.findall(part)[0]
        found[header, sum(header == other for other, _ in found)] = part
    return found


def onto(base: str, fitted: str) -> str:
    """The text of the preset `base` with the keys of its fit in place of its own, or below them."""
    made, new = tables(base), tables(fitted)
    settings = "".join(re.findall(r"^#.*\n", fitted, re.MULTILINE))
    for place in list(new)[1:]:
        for line in VALUE.finditer(new[place]):
            text = made[place]
            old = re.search(KEY.format(line[1]), text, re.MULTILINE)
            if old:
                made[place] = text[: old.start()] + line[0] + text[old.end() :]
            else:
                made[place] = END.sub(f"\n{line[0]}\n", text, count=1)
    return settings + "".join(made.values())


def fitted(folder: Path, name: str, settings: dict[str, Any]) -> str:
    """Fits a preset to its recordings and returns its text."""
    place = folder.absolute() / f"{name}.toml"
    given = [f"--{key}={settings[key]}" for key in ("like", "seed", "evaluations")]
    notes = folder.absolute() / settings["recordings"]
    command = [sys.executable, "-m", "livebass", "fit", notes, *given, "-o", place]
    subprocess.run(command, check=True, cwd=HERE.parent)
    text = place.read_text(encoding="utf-8")
    for key in settings["left_out"]:
        text = re.sub(rf"^{key} = .*\n", "", text, flags=re.MULTILINE)
    base = HERE.parent / settings["like"]
    return onto(base.read_text(encoding="utf-8"), text) if base.is_file() else text


def shipped(text: str, settings: dict[str, Any], source: dict[str, Any]) -> str:
    """The text of the shipped preset: of a fit, with its name, its source and the keys that are set by hand."""
    for word, for_others in (("your own second take", "a second take of it"), ("your bass", "that bass")):
        text = text.replace(word, for_others)
    given = {key: settings[key] for key in ("name", "description")} | settings["by_hand"]
    for key, value in given.items():
        line = f"{key} = " + (f'"{value}"' if isinstance(value, str) else str(value))
        by_hand = key in settings["by_hand"]  # on every string that has the key
        line += "  # by hand" if by_hand else ""
        text, count = re.subn(rf"^{key} = .*$", line, text, count=0 if by_hand else 1, flags=re.MULTILINE)
        if not count:
            raise SystemExit(f"{key}: not in the fitted preset")
    return f"# {source['bass']}: {source['source']},\n# {settings['notes']}.\n# {settings['why']}\n{text}"


def main() -> None:
    """Writes presets/PRESET.toml for each preset."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    fits = tomllib.loads((HERE / "fits.toml").read_text(encoding="utf-8"))
    sources = tomllib.loads((HERE / "real_notes.toml").read_text(encoding="utf-8"))
    parser.add_argument("presets", nargs="*", choices=[[], *fits], metavar="PRESET")
    given = parser.parse_args()
    for name in given.presets or fits:
        settings = fits[name]
        text = shipped(fitted(given.folder, name, settings), settings, sources[settings["recordings"]])
        (PRESETS / f"{name}.toml").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
