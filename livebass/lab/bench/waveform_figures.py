"""Waveform figures measured by `livebass bench live`. README and handbook quote them.

tools/tables.py writes them there. When a quality changes, measure again and update them here.
"""

from __future__ import annotations

# Distance of hard notes of a quality from `reference`, by KINDS of fidelity.py: dB, median and worst pluck
WAVEFORMS: dict[str, dict[str, tuple[int, int]]] = {
    "frets with loss": {"live": (-49, -23), "studio": (-54, -23)},
    "thumb": {"live": (-58, -52), "studio": (-60, -54)},
    "pops": {"live": (-47, -38), "studio": (-57, -39)},
    "guests": {"live": (-30, -14), "studio": (-36, -18)},
    "straight": {"live": (-42, -26), "studio": (-43, -34)},
    "thin": {"live": (-22, -8), "studio": (-32, -10)},
    "boards": {"live": (-45, -32), "studio": (-51, -36)},
    "lossless": {"live": (-18, -4), "studio": (-24, -5)},
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
