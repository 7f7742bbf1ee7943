"""The resonances of a neck from the measured modes of a string, as the keys of a preset.

python tools/fit_neck.py paper-g [STRING]        # or a preset that `livebass identify` wrote
python tools/fit_neck.py --anew paper-g          # from nothing, not from the neck that the preset has

A neck that the preset has is kept as it is where moving it gains next to nothing: that of paper-g comes out as shipped.
"""

from __future__ import annotations

import sys

from livebass import load_preset
from livebass.identify.fit import NeckFit, fit_neck


def keys(fit: NeckFit) -> str:
    """For [neck] of a preset."""
    rows = [(f"{r.frequency:.5g}", f"{r.quality:.3g}", f"{r.mass:.3g}") for r in fit.resonances]
    hertz, quality, mass = (", ".join(column) for column in zip(*rows, strict=True))
    return (
        f'resonance_frequencies = {{unit = "Hz", values = [{hertz}]}}\n'
        f"resonance_qualities = [{quality}]\n"
        f'resonance_masses = {{unit = "kg", values = [{mass}]}}'
    )


def table(fit: NeckFit) -> str:
    """Mode by mode, 1/s: given, of the law without neck, fitted."""
    lines = ["# mode        Hz  given 1/s    law  fitted"]
    for j, row in enumerate(zip(fit.frequency, fit.damping, fit.law, fit.fitted, strict=True), 1):
        lines.append("# {:4} {:9.2f} {:10.3f} {:6.3f} {:7.3f}".format(j, *row))
    return "\n".join(lines)


if {"-h", "--help"} & set(sys.argv):
    print(__doc__)
    sys.exit()
arguments = [a for a in sys.argv[1:] if a != "--anew"]
try:
    bass = load_preset(arguments[0] if arguments else "paper-g")
    which = bass.string_index(arguments[1]) if len(arguments) > 1 else -1
    bending = tuple(r for r in bass.necks[which].admittance.resonances if r.shape)
    fit = fit_neck(bass.strings[which], start=() if "--anew" in sys.argv else bending)
except (ValueError, LookupError, OSError) as error:
    sys.exit(f"fit_neck.py: {error}")
except KeyboardInterrupt:
    sys.exit(130)
print(table(fit))
if fit.below:
    print(f"# modes {', '.join(map(str, fit.below))} are damped less than the law: no neck can do that")
worst, played = (float(abs(s / fit.damping - 1).max()) for s in (fit.fitted, fit.played))
print(f"# {len(fit.resonances)} resonances; dampings to {fit.deviation:.1%} rms, {worst:.0%} at worst;")
print(f"# with the modes where the string's law puts them, {fit.deviation_played:.1%} rms, {played:.0%} at worst")
print(
    f"# modes off a law with f0 and B fitted anew: {1e6 * fit.scatter:.0f} ppm rms, {1e6 * fit.left:.0f} with the neck;"
)
print(f"# off that with the string's f0 and B: {1e6 * fit.own_scatter:.0f} ppm, {1e6 * fit.own_left:.0f} with the neck")
print(keys(fit))
