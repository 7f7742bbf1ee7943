"""T60 by octave of a preset, open and stopped notes, beside recordings of notes: sound files, or folders of them.

python tools/decay.py jazz-finger ~/notes-of-a-real-bass
"""

from __future__ import annotations

import sys
from pathlib import Path

from livebass import load_preset
from livebass.bench.decay import preset_notes, recorded_notes, table

name, *recordings = sys.argv[1:] or ["jazz-finger"]
if {"-h", "--help"} & set(sys.argv):
    print(__doc__)
    sys.exit()
try:
    bass = load_preset(name)
    groups = [(bass.name, preset_notes(bass))]
    if recordings:
        groups.append(("recordings", recorded_notes([Path(r) for r in recordings], bass)))
except (ValueError, LookupError, OSError) as error:
    sys.exit(f"decay.py: {error}")
except KeyboardInterrupt:
    sys.exit(130)
print(table(groups))
if recordings:
    print("of recordings, open is what sounds like an open string: they do not tell their string")
