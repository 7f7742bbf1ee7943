"""Section 4.2: figures 10 to 13, influences on the sound: dispersion, the plucking point, the neck, the frets."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from livebass.analysis.motion import Solved
from livebass.paper.cases import CASES
from livebass.paper.figures import measure, panels
from livebass.paper.figures.section_4_1 import TOP_HZ, figure_5, figure_7
from livebass.paper.figures.study import Findings, Picture
from livebass.report.picture import figure

PLUCKED = ("near-bridge", "middle", "near-nut")
NECKS = ("neck", "half-straight", "straight", "sixth-fret")


def dispersion(motions: Mapping[str, Solved]) -> Findings:
    """The study `dispersion`: figures 7a and 10, case B with dispersion and with harmonic partials."""
    return _compared(motions, {"with dispersion": motions["b"], "without dispersion": motions["harmonic"]}, figure_10)


def _compared(
    motions: Mapping[str, Solved], titled: Mapping[str, Solved], draw: Callable[[Mapping[str, Solved]], list[Picture]]
) -> Findings:
    """The findings in `motions`, with the pictures and contact sets of the `titled` ones."""
    found = measure.gathered(motions)
    found.pictures = draw(titled)
    found.tables.append(measure.sets_table(titled))
    return found


def figure_10(titled: Mapping[str, Solved]) -> list[Picture]:
    """Figure 10: contacts and pitch with dispersion and without, and the spectrogram without."""
    without = titled["without dispersion"]
    return [
        figure_7("contacts", "Figure 7a", titled),
        figure_5("spectrogram", "Without dispersion", without, glide=False),
    ]


def plucking_point(motions: Mapping[str, Solved]) -> Findings:
    """The study `plucking-point`: figure 11."""
    found = measure.gathered({name: motions[name] for name in PLUCKED})
    titled = {CASES[name].title: motions[name] for name in PLUCKED}
    found.pictures = figure_11(titled)
    found.tables.append(measure.sets_table(titled, 4))
    return found


def figure_11(titled: Mapping[str, Solved]) -> list[Picture]:
    """Figure 11: spectrograms and first shapes for three plucking points, and their contacts."""
    return [
        _spectrograms(titled, "figure 11"),
        figure_7("contacts", "The whole time", titled, until_s=_end(titled), zooms=False, pitch=False),
        figure_7("first-contacts", "The first 16 ms", titled, until_s=0.016, zooms=False, pitch=False),
    ]


def neck(motions: Mapping[str, Solved]) -> Findings:
    """The study `neck`: figure 12."""
    found = measure.gathered({name: motions[name] for name in NECKS})
    titled = {CASES[name].title: motions[name] for name in NECKS}
    found.pictures = figure_12(titled)
    rattling = _rattling(titled)
    if rattling:
        found.tables.append(measure.sets_table(rattling, 4))
    return found


def figure_12(titled: Mapping[str, Solved]) -> list[Picture]:
    """Figure 12: spectrograms over four necks, and the contacts with the necks that the string meets."""
    pictures, rattling = [_spectrograms(titled, "figure 12")], _rattling(titled)
    if rattling:
        end = min(0.12, _end(titled))
        pictures.append(figure_7("contacts", "Necks that the string meets", rattling, until_s=end, zooms=False))
    return pictures


def stiffness(motions: Mapping[str, Solved]) -> Findings:
    """The study `stiffness`: figure 13, soft frets."""
    return _compared(motions, {"K = 1e9": motions["soft"], "K = 1e13": motions["b"]}, figure_13)


def figure_13(titled: Mapping[str, Solved]) -> list[Picture]:
    """Figure 13: spectrogram, contacts and pitch with K = 1e9, and the contacts compared with K = 1e13."""
    soft = titled["K = 1e9"]
    return [
        figure_5("spectrogram", "K = 1e9", soft),
        figure_7("contacts", "K = 1e9", {"K = 1e9": soft}),
        figure_7("contacts-compared", "Soft frets and hard ones", titled, zooms=False),
    ]


def _spectrograms(motions: Mapping[str, Solved], number: str) -> Picture:
    """The spectrogram of each motion, and below it the string before its release."""
    drawn = figure(4 * len(motions), 6)
    axes = drawn.subplots(2, len(motions), height_ratios=(2, 1), squeeze=False)
    for (above, below), (title, solved) in zip(axes.T, motions.items(), strict=True):
        image = panels.spectrogram(above, measure.spectrum(solved), TOP_HZ)
        above.set_title(title, fontsize="medium")
        panels.neck(below, solved.speaking, [measure.initial_shape(solved)])
        below.set_ylim(-5, 5)
    panels.level_bar(drawn, image, list(np.ravel(axes[0])))
    caption = f"Spectrograms, 70 dB; the string before its release, and the neck ({number})"
    return Picture("spectrograms", caption, drawn)


def _rattling(motions: Mapping[str, Solved]) -> dict[str, Solved]:
    """The motions that have contacts."""
    return {title: solved for title, solved in motions.items() if solved.motion.contact_step.size}


def _end(motions: Mapping[str, Solved]) -> float:
    """The longest duration, s."""
    return max(solved.trial.duration for solved in motions.values())
