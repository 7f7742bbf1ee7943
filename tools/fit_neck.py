"""Fits a neck's resonances to the measured modes of a string on it, and prints them as keys of a preset.

python tools/fit_neck.py paper-g [STRING]        # or a preset that `livebass identify` wrote
python tools/fit_neck.py --without paper-g          # start without the preset's neck

The preset's resonances stay as they are if moving them gains next to nothing: paper-g's neck comes out as shipped.
"""

from __future__ import annotations

import argparse

from errors import clear_errors

from livebass.lab.identification.fit import NeckFit, fit_neck
from livebass.preset.load import load_preset


def keys(fit: NeckFit) -> str:
    """Returns keys for [neck] of a preset."""
    rows = [(f"{r.frequency:.5g}", f"{r.quality:.3g}", f"{r.mass:.3g}") for r in fit.resonances]
    hertz, quality, mass = (", ".join(column) for column in zip(*rows, strict=True))
    return (
        f'resonance_frequencies = {{unit = "Hz", values = [{hertz}]}}\n'
        f"resonance_qualities = [{quality}]\n"
        f'resonance_masses = {{unit = "kg", values = [{mass}]}}'
    )


def table(fit: NeckFit) -> str:
    """Returns each mode's damping, 1/s: as given, by the law without a neck, and fitted."""
    lines = ["# mode        Hz  given 1/s    law  fitted"]
    for j, row in enumerate(zip(fit.frequency, fit.damping, fit.law, fit.fitted, strict=True), 1):
        lines.append("# {:4} {:9.2f} {:10.3f} {:6.3f} {:7.3f}".format(j, *row))
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("preset", nargs="?", default="paper-g", help="name or file; default: paper-g")
    parser.add_argument("string", nargs="?", help="name of the string; default: the highest")
    parser.add_argument("--without", action="store_true", help="begin with no resonances, not with those of the preset")
    options = parser.parse_args()
    with clear_errors("fit_neck.py"):
        bass = load_preset(options.preset)
        which = bass.string_index(options.string) if options.string else -1
        bending = tuple(r for r in bass.necks[which].admittance.resonances if r.shape)
        fit = fit_neck(bass.strings[which], start=() if options.without else bending)
    print(table(fit))
    if fit.below:
        print(f"# modes {', '.join(map(str, fit.below))} are damped less than by the law: no neck can do that")
    worst, played = (float(abs(sigma / fit.damping - 1).max()) for sigma in (fit.fitted, fit.played))
    print(f"# {len(fit.resonances)} resonances; dampings to {fit.deviation:.1%} rms, {worst:.0%} at worst;")
    print(f"# with the modes where the string's law puts them, {fit.deviation_played:.1%} rms, {played:.0%} at worst")
    scatter, left, own_scatter, own_left = (
        f"{1e6 * part:.0f}" for part in (fit.scatter, fit.left, fit.own_scatter, fit.own_left)
    )
    print(f"# modes off a law with f0 and B fitted again: {scatter} ppm rms, {left} with the neck;")
    print(f"# off that with the string's f0 and B: {own_scatter} ppm, {own_left} with the neck")
    print(keys(fit))


if __name__ == "__main__":
    main()
