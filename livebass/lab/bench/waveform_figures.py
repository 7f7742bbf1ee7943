"""Waveform figures measured by `livebass bench live`. README and handbook quote them.

tools/tables.py writes them there. When a quality changes, measure again and update them here.
"""

from __future__ import annotations

# Distance of hard notes of a quality from `reference`, by KINDS of fidelity.py: dB, median and worst pluck
WAVEFORMS: dict[str, dict[str, tuple[int, int]]] = {
    "frets with loss": {"live": (-52, -26), "studio": (-66, -30)},
    "thumb": {"live": (-58, -47), "studio": (-74, -54)},
    "pops": {"live": (-45, -40), "studio": (-59, -56)},
    "guests": {"live": (-44, -9), "studio": (-63, -20)},
    "straight": {"live": (-47, -21), "studio": (-64, -44)},
    "thin": {"live": (-23, -9), "studio": (-37, -22)},
    "boards": {"live": (-45, -31), "studio": (-50, -35)},
    "lossless": {"live": (-18, -3), "studio": (-23, -4)},
}
# dB, median difference of these from plucks 0.1 % harder, in `reference`
HARDER = {"guests": -35, "straight": -38, "thin": -34}
CALLED = {
    "frets with loss": "plucked, frets with loss",
    "thumb": "thumb with a mass",
    "pops": "pops",
    "guests": "pick and pop on `jazz-finger` and `precision-finger`",
    "straight": "fingers straight up on these",
    "thin": "fingers straight up on the two highest strings of `six-string`",
    "boards": "boards with loss",
    "lossless": "frets without loss",
}


def waveform_rows() -> list[tuple[str, ...]]:
    """The rows of the handbook's table of WAVEFORMS, with the header first."""
    qualities = list(WAVEFORMS["pops"])
    rows = [("hard notes", *(f"`{quality}`" for quality in qualities))]
    for kind, near in WAVEFORMS.items():
        rows.append((CALLED[kind], *(f"{near[quality][0]}; {near[quality][1]} dB" for quality in qualities)))
    return rows


def waveform_sentence() -> str:
    """README's sentence: the medians of `live`."""
    plucked, boards, pops = (WAVEFORMS[kind]["live"][0] for kind in ("frets with loss", "boards", "pops"))
    aside = f"(boards {boards}, pops {pops}; [cost](livebass/help/cost.md))"
    return f"Hard notes in `live` match the waveform of `reference` to {plucked} dB {aside}."
