"""One case of the paper, or several over each other: figures 4 to 9 and those of section 4.2 made of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from livebass import study_draw as draw
from livebass import study_measure as measure
from livebass.analysis import Contactogram
from livebass.study_parts import Findings, Picture, Solved, curve

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
    drawn = draw.figure(11, 4.2 * len(motions))
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
    drawn = draw.figure(11 if glide else 7, 4)
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
    drawn = draw.figure(11, 7 if zooms else 4.5)
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
    drawn = draw.figure(9, 4.5)
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
