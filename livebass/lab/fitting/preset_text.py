"""The new preset's text: `like`, and only what the fit changed, each with its deviation in a comment."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from livebass import __version__
from livebass.lab.fitting.bounds import FACTORS, MIX, STEP, Free, Tables
from livebass.preset.load import preset_tables
from livebass.preset.source import is_path
from livebass.report.text import json_text
from livebass.rows.units import one_line

if TYPE_CHECKING:
    from livebass.lab.fitting.fit import Fitted

SECTIONS = ("neck", "string", "pickup", "output", "coil", "player", "pick")


def preset_text(
    like: str, place: Path, own: Tables, remarks: Mapping[tuple[str, str], str], head: Sequence[str], **top: str
) -> str:  # fmt: skip
    """The text of the preset `place` like another one: `own` keys with `remarks` by section and key, below `head`.

    top: its name and description.
    """
    if is_path(like):
        like = os.path.relpath(Path(like).resolve(), place.resolve().parent)
        like = like if is_path(like) else f"./{like}"
    lines = [*(f"# {one_line(line)}" for line in head), f"like = {_raw(like)}"]
    lines += [f"{key} = {_raw(value)}" for key, value in top.items()]
    lines += [f"{key} = {_raw(value)}" for key, value in own.items() if key not in SECTIONS]
    for section in SECTIONS:
        found = own.get(section)
        for table in found if isinstance(found, list) else [found] if found else []:
            lines += ["", f"[[{section}]]" if isinstance(found, list) else f"[{section}]"]
            for key, value in table.items():
                remark = remarks.get((section, key), "")
                lines.append(f"{key} = {_raw(value)}" + (f"  # {remark}" if remark else ""))
    return "\n".join(lines) + "\n"


def _raw(value: Any) -> str:
    """A text, a number, or a list or table of them in TOML."""
    if isinstance(value, str):
        return json_text(value, ascii_only=False).strip()
    if isinstance(value, list):
        return f"[{', '.join(map(_raw, value))}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key} = {_raw(each)}' for key, each in value.items())}}}"
    return repr(value)


def shown_deviation(f: Free, u: float, deviation: float) -> str:
    """A deviation on the scale from 0 to 1, in words."""
    low, high = f.value(u - deviation), f.value(u + deviation)
    half = (high - low) / 2
    if f.section in FACTORS:
        return f"sd {100 * half / f.value(u):.0f} %"
    unit = f" {f.unit}" if f.unit else ""
    return f"sd {half:.2g}{unit}" + (" between the pickups" if f.section == MIX else "")


def changes_from(own: Tables, base: Tables) -> Tables:
    """`own` without the keys that are as in `base`; tables of strings and pickups stay in order."""
    made: Tables = {}
    for section, found in own.items():
        there = base.get(section, {})
        if isinstance(found, list) and section in SECTIONS:
            tables = [
                {k: v for k, v in table.items() if k == "name" or v != old.get(k)}
                for table, old in zip(found, there, strict=True)
            ]
            if section == "string":
                tables = [t for t in tables if t.keys() - {"name"}]
            if any(tables):
                made[section] = tables
        elif isinstance(found, dict):
            kept = {k: v for k, v in found.items() if v != there.get(k)}
            if kept:
                made[section] = kept
        elif found != base.get(section):
            made[section] = found
    return made


def fitted_preset(fitted: Fitted, path: str | os.PathLike[str], remark: str = "livebass.fit") -> str:
    """Returns the text of a fitted preset.

    Args:
        fitted: The fit.
        path: Where the text will be written: paths in it are relative.
        remark: How the preset was made, for its first line.
    """
    problem, best = fitted.problem, fitted.best
    own = changes_from(fitted.own, problem.base)
    numbers = zip(problem.free, best.scaled, best.deviations, strict=True)
    comments = {(f.home, f.key): shown_deviation(f, u, sd) for f, u, sd in numbers if f.section != STEP}
    comments |= {("string", "inharmonicity"): "identified", ("output", "gain"): f"as loud as {problem.label}"}
    comments |= {
        ("player", key): "measured" for key in ("floor_noise", "floor_corner", "release_noise", "hum", "mains")
    }
    comments |= {("player", "softest"): "by the force of the softest notes"}
    head = [
        f"Made by livebass {__version__}: {remark}",
        f"The notes have the digest {fitted.recorded.digest}. All else is as in {problem.label}.",
        f"{fitted.sentence[0].upper()}{fitted.sentence[1:]}",
        "sd: standard deviation of the last trials.",
    ]
    name = fitted.recorded.name[:80]
    described = f"Fitted to the notes of {name}, like {Path(problem.label).stem}"
    top = {"name": name, "description": described[:500]}
    if "tuning" in problem.base and problem.base["tuning"] != preset_tables(problem.label)[1].get("tuning"):
        top["tuning"] = problem.base["tuning"]
    return preset_text(problem.label, Path(path), own, comments, head, **top)
