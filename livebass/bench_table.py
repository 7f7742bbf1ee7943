"""The figures of `bench.bench_render` as text."""

from __future__ import annotations

from typing import Any

from livebass.bench_measure import Row

# Ratio, what it says, what is wanted of it, and the measurements it is made of: the first over the second in
# processor time, which other work on the machine hardly changes, or real time over the first.
RATIOS: tuple[tuple[str, str, str, str, str | None], ...] = (
    ("reference_to_real_time", "reference over real time", "4, aim 20", "engine_reference_50k", None),
    ("reference_to_brute_force", "reference over brute force", "", "brute_force", "engine_reference_50k"),
    ("reference_to_dense_step", "reference over the dense step", "5000", "dense_step", "engine_reference_50k"),
    ("fretless_to_fretted", "cost of fretless over fretted", "at most 10", "fretless", "engine_reference_50k"),
    ("strings_one_core", "four strings live, one core", "5", "strings_live_one_core", None),
    ("strings_all_cores", "four strings live, all cores", "5", "strings_live_all_cores", None),
    ("slap_live", "slap line live, all cores", "5", "slap_live", None),
    ("slap_studio", "slap line studio, all cores", "2", "slap_studio", None),
)
HEAD = ("s of work per s of sound", "modes", "contact", "output", "cores", "runs", "best", "median", "cpu", "speed")


def table(result: dict[str, Any]) -> str:
    """The figures of `bench_render` for people; "cpu" is processor time, "speed" in times real time."""
    rows = [HEAD, *(_cells(result["measurements"][key]) for key in _order(result["measurements"]))]
    widths = [max(len(row[i]) for row in rows) for i in range(len(HEAD))]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))])
        for row in rows
    ]
    machine, agreement = result["machine"], result["agreement"]
    memory = machine["peak_resident_bytes"]
    lines += ["", *(_ratio_line(label, wanted, result["ratios"][key]) for key, label, wanted, _, _ in RATIOS)]
    same = "the same" if agreement["contacts_equal"] else f"{agreement['contacts_brute_force']} and"
    return "\n".join(
        [
            f"case B, dense step to engine: {result['case_b']}",
            *lines,
            "",
            f"engine and brute force over {agreement['until_s'] * 1e3:g} ms: {same} {agreement['contacts_engine']} "
            f"contacts, displacement within {agreement['displacement']:.1e}",
            f"livebass {result['livebass']}, {machine['cpu']}, {machine['cores']} cores, Python {machine['python']}, "
            f"numpy {machine['numpy']}, numba {machine['numba']}"
            + (f", {memory / 1e6:.0f} MB at most" if memory else ""),
        ]
    )


def _order(rows: dict[str, Row]) -> list[str]:
    """Slow ones first."""
    first = ["dense_step", "brute_force"]
    return first + [key for key in rows if key not in first]


def _cells(row: Row) -> tuple[str, ...]:
    contact, output = row["contact_rate_hz"], row["rate_hz"]
    return (
        row["name"],
        str(row["modes"]),
        f"{contact / 1e6:g} MHz",
        f"{output / 1e3:g} kHz" if output else "",
        str(row["cores"]),
        str(len(row["runs"])),
        _figure(row["seconds_per_second"]),
        _figure(row["median"]),
        _figure(row["processor"]),
        _figure(1 / row["seconds_per_second"]),
    )


def _figure(x: float) -> str:
    """Three digits, and no powers of ten above one."""
    return f"{x:.0f}" if x >= 100 else f"{x:.3g}"


def _ratio_line(label: str, wanted: str, value: float) -> str:
    return f"{label:33}{_figure(value):>8}" + (f"   wanted {wanted}" if wanted else "")
