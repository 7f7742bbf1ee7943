"""Writes a preset with an identified string in place of another; everything else stays."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from livebass.engine.prepare import pickups_under
from livebass.lab.identification.onset import Onset, middle_pluck
from livebass.lab.identification.result import Identified
from livebass.model.instrument import Instrument, String
from livebass.model.neck import Resonance
from livebass.preset.build import Builder
from livebass.preset.checks import RESONANCE_KEYS, TABLE_KEYS
from livebass.preset.load import load_preset, preset_source, preset_tables
from livebass.rows.units import note_name, note_number, one_line

MARK = "identified"
WIDTH_LIMITS, RELEASE_LIMITS = (0.5e-3, 50e-3), (1e-6, 10e-3)  # m, s, limits of a preset


def new_preset(
    base: str, old: str, result: Identified, sources: Sequence[Path], resonances: Sequence[Resonance] = ()
) -> str:
    """Returns the text of preset `base` with its string `old` as identified from the files `sources`.

    The neck under it has the `resonances` or, without any, a table of the conductance found at the partials. Everything
    else stays, comments included. Raises PresetError if the result is no valid preset: the laws damp a mode beyond
    critical, or a pitch is out of order. Needs tomlkit: pip install 'livebass[analysis]'.
    """
    import tomlkit

    label, text = preset_source(base)
    document: Any = tomlkit.parse(text)
    if "like" in document:  # then all that it inherits is written, too
        document = tomlkit.parse(tomlkit.dumps(preset_tables(base)[1]))
    target: Any = next(s for s in document["string"] if s["name"].casefold() == old.casefold())
    s = result.string
    files, rest = ", ".join(one_line(p.name) for p in sources), one_line(label)
    mutes = "relaxation", "relaxation_frequency", "extra_damping", "extra_damping_slope"
    for name in ("core_diameter", "core_modulus", "stiffness_ratio", *mutes):
        target.pop(name, None)

    with _above_end(target):
        for name, value in _values(s, target["open_note"]).items():
            _put(target, name, value)
        _put_neck(document, target, result, resonances)
    if result.onset is not None:
        _put_onset(document, load_preset(base), old, result.onset)
    document["description"] = f"String {old} identified from {files}; the rest is {rest}"[:500]
    head = f"# String {old} is identified from {files}, where marked so. The rest is {rest}.\n"
    done = head + tomlkit.dumps(document)
    parsed = tomllib.loads(done)
    Builder("the identified preset").instrument(parsed)
    if parsed != document.unwrap():  # a value that ended up in a comment would go unnoticed
        raise ArithmeticError(f"{label}: the new preset did not come out as it was meant")
    return done


@contextmanager
def _above_end(table: Any) -> Iterator[None]:
    """Keeps new keys above the blank lines and comments that end a table: these belong to the next one."""
    body = getattr(table.value, "body", [])
    cut: list[Any] = []
    while body and body[-1][0] is None:
        cut.insert(0, body.pop())
    yield
    if cut:
        table.value.body.extend(cut)


def _put(target: Any, name: str, value: str) -> None:
    """Sets a key of a table to a TOML value, with the comment MARK."""
    import tomlkit

    target[name] = tomlkit.parse(f"x = {value}")["x"]
    target[name].comment(MARK)
    target[name].trivia.comment_ws, target[name].trivia.trail = "  ", "\n"


def _put_neck(document: Any, string: Any, result: Identified, resonances: Sequence[Resonance]) -> None:
    """Sets the neck under this string only; to a rigid one if nothing was found and the preset had something."""
    values = _neck_keys(document, string, result, resonances)
    if values and "neck" not in string:
        import tomlkit

        string["neck"] = tomlkit.table()
    if values.keys() & (TABLE_KEYS | RESONANCE_KEYS):
        for name in TABLE_KEYS | RESONANCE_KEYS:
            string["neck"].pop(name, None)
    for name, value in values.items():
        _put(string["neck"], name, value)


def _neck_keys(document: Any, string: Any, result: Identified, resonances: Sequence[Resonance]) -> dict[str, str]:
    """Keys of the neck under this string with their TOML values."""
    pairs = result.conductance
    given = {**document.get("neck", {}), **string.get("neck", {})}
    if not pairs and given.keys() & {"conductance_values", "resonance_masses"}:
        pairs = ((result.law.fundamental, 0.0),)
    keys = _resonance_keys(resonances) if resonances else _table_keys(pairs) if pairs else {}
    if result.own is not None:
        keys["longer_across"] = f'"{result.own.longer * 1e3:.4g} mm"'
        if "axes_turned" in given:  # the two lines were taken for those of u and v
            keys["axes_turned"] = '"0 deg"'
        if pairs or resonances:
            keys["stiffness_across"] = f"{result.own.stiffness:.4g}"
    return keys


def _put_onset(document: Any, bass: Instrument, string: str, onset: Onset) -> None:
    """Sets the pluck, the pickups under `string`, the tone and the gain, where they differ from `bass`."""
    import tomlkit

    length = bass.strings[bass.string_index(string)].length
    width, release = middle_pluck(bass.player)
    player = {"pluck_position": f"{1 - onset.place / length:.4g}"}
    wider, slower = onset.rounding / width, onset.release / release if release else 0.0
    for name in ("rounding", "rounding_soft"):
        if value := getattr(bass.player, name) * wider:
            player[name] = _quantity(value, 1e-3, "mm", WIDTH_LIMITS)
    if slower:
        for name in ("release_time", "release_time_soft"):
            if value := getattr(bass.player, name) * slower:
                player[name] = _quantity(value, 1e-6, "us", RELEASE_LIMITS)
    else:
        player["release_time"] = _quantity(onset.release, 1e-6, "us", RELEASE_LIMITS)
    tables = {
        "player": player,
        "coil": {"tone": f"{onset.tone:.3g}"},
        "output": {"gain": f"{bass.output.gain * onset.gain:.4g}"},
    }
    for table, values in tables.items():
        if table not in document:
            document[table] = tomlkit.table()
        with _above_end(document[table]):
            for name, value in values.items():
                _put(document[table], name, value)
    ours = pickups_under(bass.output, string)
    under = [k for k, pickup in enumerate(bass.output.pickups) if any(pickup is p for p in ours)]
    for k, pickup in zip(under, onset.pickups, strict=True):
        with _above_end(document["pickup"][k]):
            _put(document["pickup"][k], "position", f'"{pickup.position * 1e3:.4g} mm"')
            _put(document["pickup"][k], "level", f"{pickup.level:.4g}")


def _quantity(value: float, unit: float, name: str, limits: tuple[float, float]) -> str:
    return f'"{min(max(value, limits[0]), limits[1]) / unit:.4g} {name}"'


def _table_keys(pairs: Sequence[tuple[float, float]]) -> dict[str, str]:
    return {
        "conductance_frequencies": _array("Hz", [x for x, _ in pairs], ".6g"),
        "conductance_values": _array("mm/s/N", [y * 1e3 for _, y in pairs], ".4g"),
    }


def _resonance_keys(resonances: Sequence[Resonance]) -> dict[str, str]:
    return {
        "resonance_frequencies": _array("Hz", [r.frequency for r in resonances], ".6g"),
        "resonance_qualities": f"[{', '.join(f'{r.quality:.3g}' for r in resonances)}]",
        "resonance_masses": _array("kg", [r.mass for r in resonances], ".3g"),
        "resonance_shapes": f"[{', '.join(str(r.shape) for r in resonances)}]",
    }


def _values(s: String, open_note: Any) -> dict[str, str]:
    """Keys of the string with their TOML values."""
    note = {} if note_number(open_note) == s.open_note else {"open_note": f'"{note_name(s.open_note)}"'}
    return note | {
        "tension": f'"{s.tension:.6g} N"',
        "diameter": f'"{s.diameter * 1e3:.4g} mm"',
        "inharmonicity": f"{s.inharmonicity:.5g}",
        "stiffness_law": f'"{s.stiffness_law}"',
        "viscoelastic_angle": f"{s.viscoelastic_angle:.4g}",
        "thermoelastic": f"{s.thermoelastic:.3g}",
        "law_fundamental": f'"{s.law_fundamental:.6f} Hz"',
        "measured_frequencies": _array("Hz", s.measured_frequencies, ".9g"),
        "measured_dampings": _array("/s", s.measured_dampings, ".6g"),
    }


def _array(unit: str, values: Sequence[float], digits: str) -> str:
    """A TOML array of quantities of one unit, eight a line."""
    shown = [format(v, digits) for v in values]
    lines = ["    " + ", ".join(shown[i : i + 8]) + ",\n" for i in range(0, len(shown), 8)]
    return f'{{unit = "{unit}", values = [\n{"".join(lines)}]}}'
