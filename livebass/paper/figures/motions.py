"""One case of the paper, or several over each other: figures 4 to 9 and those of section 4.2 made of them.

Case B from within: the string's shape over the neck (figure 8), its energy, that of its modes, their T60.

Section 4.1.3 and 4.2: oblique pluck, no dispersion, plucking points, necks, soft frets.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from livebass.analysis import motion as modal_motion
from livebass.analysis import motion as motion_analysis
from livebass.analysis.sound import Contactogram
from livebass.arrays import Floats
from livebass.model import modes
from livebass.model.trial import Trial
from livebass.paper.cases import CASES
from livebass.paper.figures import draw, measure
from livebass.paper.figures.measure import Findings, Picture, Solved, Table, curve
from livebass.report.picture import figure

ZOOMS = ((0.0, 0.02), (0.05, 0.07), (0.75, 0.77))  # s, of figure 4
GLIDE_HZ, GLIDE_S = 1500.0, 0.2  # the zoom of figure 5
TOP_HZ, SHOWN_S = 8000.0, 0.7


def case_findings(name: str, title: str, solved: Solved, glide: bool = True) -> Findings:
    """Displacement, spectrogram, characteristic frequency, contacts and pitch of one motion; its sound and data."""
    found = Findings()
    found.pictures.append(displacement_picture(f"{name}-displacement", {title: solved}, "figure 4"))
    found.pictures.append(spectrogram_picture(f"{name}-spectrogram", title, solved, glide))
    add_data(found, name, title, solved)
    found.tables.insert(0, measure.numbers_table({title: found.numbers[name]}))
    if solved.motion.contact_step.size:
        found.pictures.append(contacts_picture(f"{name}-contacts", {title: solved}))
        found.tables.insert(1, measure.sets_table({title: solved}))
    return found


def add_data(found: Findings, name: str, title: str, solved: Solved) -> None:
    """The sound of a motion, its arrays under names that begin with `name`, its curves and its numbers."""
    for across in (False, True)[: 1 if solved.motion.across_m is None else 2]:
        axis = "v" if across else "u"
        place = solved.trial.sensor_v if across else solved.trial.sensor
        where = (solved.speaking.length - (place or solved.trial.sensor)) * 1e3
        found.sounds.append(
            measure.sound(f"{name}-{axis}", f"{title}: {axis} at {where:.0f} mm from the bridge", solved, across)
        )
        time_s, nu = measure.characteristic(solved, across)
        found.arrays |= {
            f"{name}_{axis}_m": solved.displacement(across),
            f"{name}_{axis}_characteristic_frequency_hz": nu,
            f"{name}_characteristic_time_s": time_s,
        }
        found.tables.append(
            curve(f"{name}-{axis}-characteristic-frequency", "Eq. 14", time_s=time_s, characteristic_frequency_hz=nu)
        )
    time_s, change = measure.variation(solved)
    found.tables.append(curve(f"{name}-pitch", "YIN", time_s=time_s, relative_frequency_variation=change))
    found.tables.append(measure.contacts_table(f"{name}-contacts", solved))
    found.arrays |= {
        f"{name}_time_s": solved.motion.time_s,
        f"{name}_contact_time_s": solved.contacts.time_s,
        f"{name}_contact_fret": solved.contacts.fret,
        f"{name}_contact_place_m": solved.contact_place,
        f"{name}_pitch_time_s": time_s,
        f"{name}_frequency_variation": change,
        f"{name}_initial_u_m": measure.initial_shape(solved),
        f"{name}_obstacle_positions_m": np.asarray(solved.speaking.contact_position),
        f"{name}_obstacle_heights_m": np.asarray(solved.speaking.contact_height),
    }
    found.numbers[name] = measure.numbers(solved)


def displacement_picture(name: str, motions: Mapping[str, Solved], like: str, across: bool = False) -> Picture:
    """All of each displacement, and three zooms under it."""
    drawn = figure(11, 4.2 * len(motions))
    parts = np.atleast_1d(drawn.subfigures(len(motions), 1))
    axis_name = "v" if across else "u"
    for part, (title, solved) in zip(parts, motions.items(), strict=True):
        part.suptitle(title)
        axes = part.subplot_mosaic([["all"] * 3, [0, 1, 2]])
        time_s, moved = solved.motion.time_s, solved.displacement(across)
        draw.displacement_panel(axes["all"], time_s, moved, axis_name)
        for k, (start, end) in enumerate(ZOOMS):
            seen = (time_s >= start) & (time_s <= end)
            if seen.any():
                draw.displacement_panel(axes[k], time_s[seen], moved[seen], axis_name)
            else:
                axes[k].set_axis_off()  # a shortened motion
    return Picture(name, f"Displacement at the sensor, and zooms ({like} of the paper)", drawn)


def spectrogram_picture(name: str, title: str, solved: Solved, glide: bool, across: bool = False) -> Picture:
    """Over 70 dB up to 8 kHz; with `glide`, the beginning below 1.5 kHz beside it."""
    shown = measure.spectrum(solved, across)
    drawn = figure(11 if glide else 7, 4)
    axes = np.atleast_1d(drawn.subplots(1, 2 if glide else 1))
    image = draw.spectrogram_panel(axes[0], shown, TOP_HZ, SHOWN_S)
    if glide:
        draw.spectrogram_panel(axes[1], shown, GLIDE_HZ, GLIDE_S)
    draw.level_bar(drawn, image, list(axes))
    drawn.suptitle(title)
    return Picture(name, "Spectrogram of the displacement, 70 dB (as figure 5 of the paper)", drawn)


def contacts_picture(
    name: str, motions: Mapping[str, Solved], until_s: float | None = None, zooms: bool = True, pitch: bool = True
) -> Picture:
    """Which fret is touched when, the fundamental over it, and the first three sets from near."""
    drawn = figure(11, 7 if zooms else 4.5)
    rows: list[list[Any]] = [["all"] * 3, [0, 1, 2]] if zooms else [["all"]]
    axes = drawn.subplot_mosaic(rows, height_ratios=[3, 2][: len(rows)])
    above = axes["all"].twinx() if pitch else None
    last = max(contact_phase_end(s.contacts) for s in motions.values())
    end = until_s or 1.15 * last + 0.01
    for k, (title, solved) in enumerate(motions.items()):
        draw.contacts_panel(axes["all"], solved, f"contacts, {title}", k)
        if above is not None:
            time_s, change = measure.variation(solved)
            seen = time_s <= end
            draw.variation_panel(above, time_s[seen], change[seen], f"frequency, {title}", k)
        for i in range(3 if zooms else 0):
            draw.contacts_panel(axes[i], solved, title, k)
    for i, which in enumerate(("first", "second", "third") if zooms else ()):
        axes[i].set(xlim=measure.set_times(motions.values(), i), title=f"{which} set of contacts")
        axes[i].locator_params(axis="x", nbins=4)
    axes["all"].set_xlim(0, end)
    draw.legend(*([axes["all"]] if above is None else [axes["all"], above]))
    what = "Contacts" + (" and relative variation of the fundamental (YIN)" if pitch else "")
    return Picture(name, what + ("; the first three sets from near" if zooms else ""), drawn)


def contact_phase_end(contacts: Contactogram, gap: float = 0.2) -> float:
    """When the contacts that follow each other within `gap` (s) from the first one on are over, s."""
    if not contacts.time_s.size:
        return 0.0
    silent = np.flatnonzero(np.diff(contacts.time_s) > gap)
    return float(contacts.time_s[silent[0] if silent.size else -1])


def together(motions: Mapping[str, Solved]) -> Findings:
    """Figures 4 and 6: cases A, B and C over each other."""
    named = {f"Case {key.upper()}": motions[key] for key in ("a", "b", "c")}
    drawn = figure(9, 4.5)
    axis = drawn.subplots()
    found = Findings(pictures=[displacement_picture("displacements", named, "figure 4")])
    for k, (title, solved) in enumerate(named.items()):
        time_s, nu = measure.characteristic(solved)
        axis.plot(time_s, nu, color=draw.COLOURS[k], marker="x+o"[k], markevery=max(1, nu.size // 30), label=title)
        found.numbers[title] = measure.numbers(solved)
        found.arrays |= {"time_s": time_s, f"case_{title[-1].lower()}_hz": nu}
    axis.set(xlabel="time (s)", ylabel="characteristic frequency (Hz)", ylim=(0, None))
    axis.legend()
    caption = "Characteristic frequency over time, eq. 14 at 51.2 kHz (figure 6 of the paper)"
    found.pictures.append(Picture("characteristic-frequency", caption, drawn))
    found.tables += [
        measure.numbers_table(found.numbers),
        curve("characteristic-frequency", caption, **found.arrays),
    ]
    return found


SHAPE_TIMES = (0.0, 3.5e-3, 3.9e-3, 4.1e-3, 4.3e-3, 4.7e-3)  # s, of figure 8
SHAPE_RATE = 50_000  # Hz, of which they are whole samples
SHOWN_MODES = (1, 2, 3, 5, 10, 20, 45)  # 45: around the 4.5 kHz that section 4.1.1 names
T60_MODES = 60  # drawn
DECADES = 10  # of energy, in which a decay is fitted


def energy_trials(duration: float | None) -> dict[str, Trial]:
    """Case B, and its first 5 ms with whole samples at the times of figure 8."""
    short = replace(CASES["b"], duration=SHAPE_TIMES[-1]).trial(SHAPE_RATE)
    looked = motion_analysis.looked_at(short, 1, SHAPE_TIMES)
    return {"b": measure.case_trial("b", duration), "shapes": replace(short, states=looked)}


def energy_report(motions: Mapping[str, Solved]) -> Findings:
    """All of case B."""
    solved = motions["b"]
    found = case_findings("b", "Case B", solved)
    _shapes(found, motions["shapes"])
    time_s, each, total = motion_analysis.energies(solved.trial, solved.motion)
    found.arrays |= {"energy_time_s": time_s, "energy_j": total, "modal_energies_j": each}
    found.tables.append(curve("energy", "Energy of the string and its contacts", time_s=time_s, energy_j=total))
    found.numbers["energy_j"] = {"initial": float(total[0]), "final": float(total[-1])}
    found.pictures.append(_energies(time_s, each, total))
    _decays(found, solved, time_s, each)
    return found


def _shapes(found: Findings, solved: Solved) -> None:
    """Figure 8."""
    s = solved.speaking
    _, x, (shapes,) = motion_analysis.shapes(solved.trial, solved.motion, SHAPE_TIMES)
    drawn = figure(11, 5.5)
    axes = np.ravel(drawn.subplots(2, 3, sharex=True, sharey=True))
    for axis, t, shape in zip(axes, SHAPE_TIMES, shapes, strict=True):
        draw.neck_panel(axis, s, [shape])
        axis.set(title=f"t = {t * 1e3:g} ms", ylim=(-4.5, 4.5))
    caption = "The string over the neck during the first set of contacts (figure 8)"
    found.pictures.append(Picture("shapes", caption, drawn))
    columns = {f"u_m_at_{t * 1e3:g}_ms": shape for t, shape in zip(SHAPE_TIMES, shapes, strict=True)}
    found.tables.append(curve("shapes", "The string's shape", x_m=x, **columns))
    found.arrays |= {"shape_time_s": np.asarray(SHAPE_TIMES), "shape_x_m": x, "shapes_m": shapes}


def _energies(time_s: Floats, each: Floats, total: Floats) -> Picture:
    """Total at the left, modes at the right."""
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


def _decays(found: Findings, solved: Solved, time_s: Floats, each: Floats) -> None:
    """T60 of each mode: as its damping says, and as its energy fell after the last contact."""
    s, count = solved.speaking, solved.trial.modes
    sigma = modes.dampings(s, count)
    model = modal_motion.t60(sigma)
    contacts = solved.contacts.time_s
    free = time_s > (contacts[-1] if contacts.size else 0.0)
    fitted = np.full(count, np.nan)
    if np.count_nonzero(free) > 2:
        rest = each[free]
        rest = np.where(rest > rest.max() * 10.0**-DECADES, rest, 0.0)  # the rest is rounding, or a mode laid to rest
        rates = modal_motion.decay_rates(time_s[free], rest)
        fitted = np.where(np.isnan(rates), np.nan, modal_motion.t60(rates))
    drawn = figure(9, 4.5)
    axis = drawn.subplots()
    j = np.arange(1, count + 1)
    shown = slice(0, T60_MODES)
    axis.semilogy(j[shown], model[shown], "o", markerfacecolor="none", label="3 ln 10 / sigma", color="tab:blue")
    axis.semilogy(j[shown], fitted[shown], "x", label="from its energy after the last contact", color="tab:red")
    axis.set(xlabel="mode number", ylabel="T60 (s)")
    axis.legend()
    found.pictures.append(Picture("t60", "Time in which each mode falls by 60 dB", drawn))
    nu = modes.frequencies(s, count)
    columns = {"frequency_hz": nu, "damping_per_s": sigma, "t60_s": model, "t60_from_energy_s": fitted}
    found.tables.append(curve("t60", "T60 by mode", mode=j, **columns))
    first = [tuple(float(column[k]) for column in (j, nu, model, fitted)) for k in range(10)]
    heads = "mode", "frequency (Hz)", "T60 (s)", "from its energy (s)"
    found.tables.append(Table("t60-first-modes", "T60 of the first ten modes", heads, first))
    found.arrays |= {"t60_s": model, "t60_from_energy_s": fitted}


PLUCKED = ("near-bridge", "middle", "near-nut")
NECKS = ("neck", "half-straight", "straight", "sixth-fret")


def oblique(motions: Mapping[str, Solved]) -> Findings:
    """Figure 9: both polarisations."""
    solved = motions["oblique"]
    found = _gathered({"oblique": solved})
    drawn = figure(11, 8)
    upper, lower = drawn.subfigures(2, 1)
    rows = upper.subplots(2, 3, squeeze=False)
    for axes, across in zip(rows, (False, True), strict=True):
        time_s, moved = solved.motion.time_s, solved.displacement(across)
        for axis, (start, end) in zip(axes, ZOOMS, strict=True):
            seen = (time_s >= start) & (time_s <= end)
            if seen.any():
                draw.displacement_panel(axis, time_s[seen], moved[seen], "v" if across else "u", 2 * across)
            else:
                axis.set_axis_off()
    axes = lower.subplots(1, 2)
    for axis, across in zip(axes, (False, True), strict=True):
        image = draw.spectrogram_panel(axis, measure.spectrum(solved, across), TOP_HZ, SHOWN_S)
        axis.set_title("v, across the neck" if across else "u, away from the neck")
    draw.level_bar(lower, image, list(axes))
    caption = "Displacements along u and v, 9 and 18 mm from the bridge, and their spectrograms (figure 9)"
    found.pictures.append(Picture("polarisations", caption, drawn))
    found.pictures.append(contacts_picture("contacts", {"oblique": solved}))
    return found


def dispersion(motions: Mapping[str, Solved]) -> Findings:
    """Figures 7a and 10: case B with its harmonics in tune."""
    named = {"with dispersion": motions["b"], "without dispersion": motions["harmonic"]}
    found = _gathered(motions)
    found.pictures = [
        contacts_picture("contacts", named),
        spectrogram_picture("spectrogram", "Without dispersion", motions["harmonic"], glide=False),
    ]
    found.tables.append(measure.sets_table(named))
    return found


def plucking_point(motions: Mapping[str, Solved]) -> Findings:
    """Figure 11."""
    found = _gathered({name: motions[name] for name in PLUCKED})
    titled = {CASES[name].title: motions[name] for name in PLUCKED}
    found.pictures = [
        _spectrograms("spectrograms", titled, "figure 11"),
        contacts_picture("contacts", titled, until_s=_end(titled), zooms=False, pitch=False),
        contacts_picture("first-contacts", titled, until_s=0.016, zooms=False, pitch=False),
    ]
    found.tables.append(measure.sets_table(titled, 4))
    return found


def neck(motions: Mapping[str, Solved]) -> Findings:
    """Figure 12."""
    found = _gathered({name: motions[name] for name in NECKS})
    titled = {CASES[name].title: motions[name] for name in NECKS}
    rattling = {title: solved for title, solved in titled.items() if solved.motion.contact_step.size}
    found.pictures.append(_spectrograms("spectrograms", titled, "figure 12"))
    if rattling:
        found.pictures.append(contacts_picture("contacts", rattling, until_s=min(0.12, _end(titled)), zooms=False))
        found.tables.append(measure.sets_table(rattling, 4))
    return found


def stiffness(motions: Mapping[str, Solved]) -> Findings:
    """Figure 13: K = 1e9."""
    named = {"K = 1e9": motions["soft"], "K = 1e13": motions["b"]}
    found = _gathered(motions)
    found.pictures = [
        spectrogram_picture("spectrogram", "K = 1e9", motions["soft"], glide=True),
        contacts_picture("contacts", {"K = 1e9": motions["soft"]}),
        contacts_picture("contacts-compared", named, zooms=False),
    ]
    found.tables.append(measure.sets_table(named))
    return found


def _gathered(motions: Mapping[str, Solved]) -> Findings:
    """Data, sounds and numbers of several cases."""
    found = Findings()
    for name, solved in motions.items():
        add_data(found, name, CASES[name].title, solved)
    told = {CASES[name].title: numbers for name, numbers in found.numbers.items()}
    found.tables.insert(0, measure.numbers_table(told))
    return found


def _spectrograms(name: str, motions: Mapping[str, Solved], like: str) -> Picture:
    """A spectrogram each, and under it what the string was before its release."""
    drawn = figure(4 * len(motions), 6)
    axes = drawn.subplots(2, len(motions), height_ratios=(2, 1), squeeze=False)
    for (above, below), (title, solved) in zip(axes.T, motions.items(), strict=True):
        image = draw.spectrogram_panel(above, measure.spectrum(solved), TOP_HZ)
        above.set_title(title, fontsize="medium")
        draw.neck_panel(below, solved.speaking, [measure.initial_shape(solved)])
        below.set_ylim(-5, 5)
    draw.level_bar(drawn, image, list(np.ravel(axes[0])))
    return Picture(name, f"Spectrograms, 70 dB; the string before its release, and the neck ({like})", drawn)


def _end(motions: Mapping[str, Solved]) -> float:
    return max(solved.trial.duration for solved in motions.values())
