"""Section 4.1: figures 4 to 9, and the energies and decays of case B.

Figures 4 to 7 can be drawn for any case: displacement, spectrogram, characteristic frequency, contacts with the pitch.
Figure 8 is the string over the neck in case B, figure 9 the oblique pluck.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from livebass.lab.analysis.motion import Solved, decay_rates, state_samples, t60
from livebass.lab.paper.cases import CASES
from livebass.lab.paper.figures import measure, panels
from livebass.lab.paper.figures.study import Findings, Picture, Table, curve
from livebass.lab.paper.solving import Job
from livebass.model.modes import dampings, frequencies
from livebass.report.picture import figure
from livebass.rows.arrays import Floats
from livebass.sound.analysis import Contactogram

ZOOMS = ((0.0, 0.02), (0.05, 0.07), (0.75, 0.77))  # s, of figure 4
GLIDE_HZ, GLIDE_S = 1500.0, 0.2  # the zoom of figure 5
TOP_HZ, SHOWN_S = 8000.0, 0.7  # of spectrograms
SHAPE_TIMES = (0.0, 3.5e-3, 3.9e-3, 4.1e-3, 4.3e-3, 4.7e-3)  # s, of figure 8
SHAPE_RATE = 50_000  # Hz, makes these times whole samples
SHOWN_MODES = (1, 2, 3, 5, 10, 20, 45)  # 45: around the 4.5 kHz of section 4.1.1
T60_MODES = 60  # drawn
DECADES = 10  # of energy, for fitting a decay


def one_case(name: str, title: str) -> Callable[[Mapping[str, Solved]], Findings]:
    """The report of a study of one case: its figures 4, 5 and 7, sound and data."""
    return lambda motions: _case_findings(name, title, motions[name])


def _case_findings(name: str, title: str, solved: Solved) -> Findings:
    found = Findings()
    found.pictures.append(figure_4(f"{name}-displacement", {title: solved}))
    found.pictures.append(figure_5(f"{name}-spectrogram", title, solved))
    measure.add_data(found, name, title, solved)
    found.tables.insert(0, measure.numbers_table({title: found.numbers[name]}))
    if solved.motion.contact_step.size:
        found.pictures.append(figure_7(f"{name}-contacts", title, {title: solved}))
        found.tables.insert(1, measure.sets_table({title: solved}))
    return found


def together(motions: Mapping[str, Solved]) -> Findings:
    """The study `cases`: figures 4 and 6, with cases A, B and C superimposed."""
    titled = {f"Case {key.upper()}": motions[key] for key in ("a", "b", "c")}
    characteristic = figure_6(titled)
    found = Findings(pictures=[figure_4("displacements", titled), characteristic])
    for title, solved in titled.items():
        time_s, nu = solved.characteristic()
        found.numbers[title] = measure.numbers(solved)
        found.arrays |= {"time_s": time_s, f"case_{title[-1].lower()}_hz": nu}
    found.tables += [
        measure.numbers_table(found.numbers),
        curve("characteristic-frequency", characteristic.caption, **found.arrays),
    ]
    return found


def case_b_jobs(duration: float | None) -> dict[str, Job]:
    """Case B, and its first 5 ms at an output rate that makes the times of figure 8 whole samples."""
    short = replace(CASES["b"], duration=SHAPE_TIMES[-1]).trial(SHAPE_RATE)
    short = replace(short, states=state_samples(short, 1, SHAPE_TIMES))
    return {"b": measure.case_job("b", duration), "shapes": Job(short)}


def case_b(motions: Mapping[str, Solved]) -> Findings:
    """The study `b`: figures 4, 5, 7 and 8 of case B, its energies and decays."""
    solved, begun = motions["b"], motions["shapes"]
    found = _case_findings("b", "Case B", solved)
    found.pictures.append(figure_8(begun))
    _, x, (shapes,) = begun.shapes(SHAPE_TIMES)
    by_time = {f"u_m_at_{t * 1e3:g}_ms": shape for t, shape in zip(SHAPE_TIMES, shapes, strict=True)}
    found.tables.append(curve("shapes", "The string's shape", x_m=x, **by_time))
    found.arrays |= {"shape_time_s": np.asarray(SHAPE_TIMES), "shape_x_m": x, "shapes_m": shapes}
    time_s, each, total = solved.energies()
    found.arrays |= {"energy_time_s": time_s, "energy_j": total, "modal_energies_j": each}
    found.tables.append(curve("energy", "Energy of the string and its contacts", time_s=time_s, energy_j=total))
    found.numbers["energy_j"] = {"initial": float(total[0]), "final": float(total[-1])}
    found.pictures.append(_energies(time_s, each, total))
    _add_decays(found, solved, time_s, each)
    return found


def oblique(motions: Mapping[str, Solved]) -> Findings:
    """The study `oblique`: figure 9, and the contacts as in figure 7."""
    solved = motions["oblique"]
    found = measure.gather({"oblique": solved})
    found.pictures += [figure_9(solved), figure_7("contacts", "Oblique pluck", {"oblique": solved})]
    return found


def figure_4(name: str, motions: Mapping[str, Solved]) -> Picture:
    """Figure 4: each displacement as a whole, with three zooms below."""
    drawn = figure(11, 4.2 * len(motions))
    parts = np.atleast_1d(drawn.subfigures(len(motions), 1))
    for part, (title, solved) in zip(parts, motions.items(), strict=True):
        if len(motions) > 1:
            part.suptitle(title)
        axes = part.subplot_mosaic([["all"] * 3, [0, 1, 2]])
        time_s, moved = solved.motion.time_s, solved.displacement()
        panels.displacement(axes["all"], time_s, moved)
        _draw_zooms([axes[k] for k in range(3)], time_s, moved)
    start = next(iter(motions)) if len(motions) == 1 else "Case by case"  # a single title is not in the figure
    return Picture(name, f"{start}: displacement at the sensor, and zooms (figure 4 of the paper)", drawn)


def _draw_zooms(axes: Iterable[Any], time_s: Floats, moved: Floats, name: str = "u", number: int = 0) -> None:
    """Draw the displacement within each of `ZOOMS`; an axis stays empty if the motion is too short."""
    for axis, (start, end) in zip(axes, ZOOMS, strict=True):
        seen = (time_s >= start) & (time_s <= end)
        if seen.any():
            panels.displacement(axis, time_s[seen], moved[seen], name, number)
        else:
            axis.set_axis_off()


def figure_5(name: str, title: str, solved: Solved, glide: bool = True) -> Picture:
    """Figure 5: spectrogram over 70 dB up to 8 kHz; with `glide` its beginning below 1.5 kHz beside it."""
    shown = measure.spectrum(solved)
    drawn = figure(11 if glide else 7, 4)
    axes = np.atleast_1d(drawn.subplots(1, 2 if glide else 1))
    image = panels.spectrogram(axes[0], shown, TOP_HZ, SHOWN_S)
    if glide:
        panels.spectrogram(axes[1], shown, GLIDE_HZ, GLIDE_S)
    panels.level_bar(drawn, image, list(axes))
    beginning = ", and its beginning" if glide else ""
    return Picture(
        name, f"{title}: spectrogram of the displacement, 70 dB{beginning} (as figure 5 of the paper)", drawn
    )


def figure_6(motions: Mapping[str, Solved]) -> Picture:
    """Figure 6: characteristic frequency over time, by title."""
    drawn = figure(9, 4.5)
    axis = drawn.subplots()
    for k, (title, solved) in enumerate(motions.items()):
        time_s, nu = solved.characteristic()
        axis.plot(time_s, nu, color=panels.COLOURS[k], marker="x+o"[k], markevery=max(1, nu.size // 30), label=title)
    axis.set(xlabel="time (s)", ylabel="characteristic frequency (Hz)", ylim=(0, None))
    axis.legend()
    caption = "Characteristic frequency over time, eq. 14 at 51.2 kHz (figure 6 of the paper)"
    return Picture("characteristic-frequency", caption, drawn)


def figure_7(
    name: str, caption: str, motions: Mapping[str, Solved], until_s: float | None = None, zooms: bool = True,
    pitch: bool = True,
) -> Picture:  # fmt: skip
    """Figure 7: contacts with the frets, the fundamental over them, and zooms of the first three sets.

    `caption` is its beginning. `until_s` ends the time axis; without `zooms` or `pitch` these parts are left out.
    """
    drawn = figure(11, 7 if zooms else 4.5)
    rows: list[list[Any]] = [["all"] * 3, [0, 1, 2]] if zooms else [["all"]]
    axes = drawn.subplot_mosaic(rows, height_ratios=[3, 2][: len(rows)])
    above = axes["all"].twinx() if pitch else None
    last = max(contact_phase_end(s.contacts) for s in motions.values())
    end = until_s or 1.15 * last + 0.01
    for k, (title, solved) in enumerate(motions.items()):
        panels.contacts(axes["all"], solved, f"contacts, {title}", k)
        if above is not None:
            time_s, change = measure.variation(solved)
            seen = time_s <= end
            panels.variation(above, time_s[seen], change[seen], f"frequency, {title}", k)
        for i in range(3 if zooms else 0):
            panels.contacts(axes[i], solved, title, k)
    for i, which in enumerate(("first", "second", "third") if zooms else ()):
        axes[i].set(xlim=measure.set_times(motions.values(), i), title=f"{which} set of contacts")
        axes[i].locator_params(axis="x", nbins=3)
    axes["all"].set_xlim(0, end)
    panels.legend(*([axes["all"]] if above is None else [axes["all"], above]))
    shown = f"{caption}: contacts" + (" and relative variation of the fundamental (YIN)" if pitch else "")
    return Picture(name, shown + ("; the first three sets from near" if zooms else ""), drawn)


def contact_phase_end(contacts: Contactogram, gap: float = 0.2) -> float:
    """Time of the last contact before the first pause longer than `gap` (s), s; 0 without contacts."""
    if not contacts.time_s.size:
        return 0.0
    silent = np.flatnonzero(np.diff(contacts.time_s) > gap)
    return float(contacts.time_s[silent[0] if silent.size else -1])


def figure_8(solved: Solved) -> Picture:
    """Figure 8: the string over the neck at `SHAPE_TIMES`."""
    _, _, (shapes,) = solved.shapes(SHAPE_TIMES)
    drawn = figure(11, 5.5)
    axes = np.ravel(drawn.subplots(2, 3, sharex=True, sharey=True))
    for axis, t, shape in zip(axes, SHAPE_TIMES, shapes, strict=True):
        panels.neck(axis, solved.speaking, [shape])
        axis.set(title=f"t = {t * 1e3:g} ms", ylim=(-4.5, 4.5))
    return Picture("shapes", "The string over the neck during the first set of contacts (figure 8)", drawn)


def figure_9(solved: Solved) -> Picture:
    """Figure 9: zooms and spectrograms of both displacements, u above v."""
    drawn = figure(11, 8)
    upper, lower = drawn.subfigures(2, 1)
    rows = upper.subplots(2, 3, squeeze=False)
    for axes, across in zip(rows, (False, True), strict=True):
        _draw_zooms(axes, solved.motion.time_s, solved.displacement(across), "v" if across else "u", 2 * across)
    axes = lower.subplots(1, 2)
    for axis, across in zip(axes, (False, True), strict=True):
        image = panels.spectrogram(axis, measure.spectrum(solved, across), TOP_HZ, SHOWN_S)
        axis.set_title("v, across the neck" if across else "u, away from the neck")
    panels.level_bar(lower, image, list(axes))
    caption = "Displacements along u and v, 9 and 18 mm from the bridge, and their spectrograms (figure 9)"
    return Picture("polarisations", caption, drawn)


def _energies(time_s: Floats, each: Floats, total: Floats) -> Picture:
    """Energy over time: the total at the left, some modes at the right."""
    drawn = figure(11, 4.5)
    left, right = drawn.subplots(1, 2)
    left.semilogy(time_s, total, color="black")
    left.set(xlabel="time (s)", ylabel="energy of string and contacts (J)")
    for k, mode in enumerate(SHOWN_MODES):
        right.semilogy(time_s, np.maximum(each[:, mode - 1], 1e-30), color=f"C{k}", label=f"mode {mode}", linewidth=1)
    right.set(xlabel="time (s)", ylabel="energy of a mode (J)")
    right.set_ylim(float(total[0]) * 1e-9, float(total[0]) * 2)
    right.legend(fontsize="small", ncols=2)
    return Picture("energy", "Energy over time: of all, and of some modes, which contacts feed", drawn)


def _add_decays(found: Findings, solved: Solved, time_s: Floats, each: Floats) -> None:
    """Add the T60 of each mode to `found`: from its damping, and from its energy after the last contact."""
    s, count = solved.speaking, solved.trial.modes
    sigma = dampings(s, count)
    model = t60(sigma)
    contacts = solved.contacts.time_s
    free = time_s > (contacts[-1] if contacts.size else 0.0)
    fitted = np.full(count, np.nan)
    if np.count_nonzero(free) > 2:
        rest = each[free]
        rest = np.where(rest > rest.max() * 10.0**-DECADES, rest, 0.0)  # below: rounding, or a mode no longer computed
        rates = decay_rates(time_s[free], rest)
        fitted = np.where(np.isnan(rates), np.nan, t60(rates))
    drawn = figure(9, 4.5)
    axis = drawn.subplots()
    j = np.arange(1, count + 1)
    shown = slice(0, T60_MODES)
    axis.semilogy(j[shown], model[shown], "o", markerfacecolor="none", label="3 ln 10 / sigma", color="tab:blue")
    axis.semilogy(j[shown], fitted[shown], "x", label="from its energy after the last contact", color="tab:red")
    axis.set(xlabel="mode number", ylabel="T60 (s)")
    axis.legend()
    found.pictures.append(Picture("t60", "Time in which each mode falls by 60 dB", drawn))
    nu = frequencies(s, count)
    columns = {"frequency_hz": nu, "damping_per_s": sigma, "t60_s": model, "t60_from_energy_s": fitted}
    found.tables.append(curve("t60", "T60 by mode", mode=j, **columns))
    first = [tuple(float(column[k]) for column in (j, nu, model, fitted)) for k in range(10)]
    heads = "mode", "frequency (Hz)", "T60 (s)", "from its energy (s)"
    found.tables.append(Table("t60-first-modes", "T60 of the first ten modes", heads, first))
    found.arrays |= {"t60_s": model, "t60_from_energy_s": fitted}
