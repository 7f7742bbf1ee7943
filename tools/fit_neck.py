"""The resonances of a neck from the measured modes of a string, as the keys of a preset.

python tools/fit_neck.py paper-g [STRING]        # or a preset that `livebass identify` wrote
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
try:
    bass = load_preset(sys.argv[1] if len(sys.argv) > 1 else "paper-g")
    fit = fit_neck(bass.strings[bass.string_index(sys.argv[2]) if len(sys.argv) > 2 else -1])
except (ValueError, LookupError, OSError) as error:
    sys.exit(f"fit_neck.py: {error}")
except KeyboardInterrupt:
    sys.exit(130)
print(table(fit))
if fit.below:
    print(f"# modes {', '.join(map(str, fit.below))} are damped less than the law: no neck can do that")
print(f"# {len(fit.resonances)} resonances; dampings to {fit.deviation:.1%} rms")
print(f"# scatter of the modes about their law: {1e6 * fit.scatter:.0f} ppm, without the neck {1e6 * fit.left:.0f} ppm")
print(keys(fit))
