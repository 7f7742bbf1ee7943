"""Prints a preset's T60 by octave, for open and stopped notes, beside recordings: sound files, or folders of them.

python tools/decay.py jazz-finger ~/notes-of-a-real-bass
"""

from __future__ import annotations

import argparse
from pathlib import Path

from errors import clear_errors

from livebass.bench.decay import preset_notes, recorded_notes, table
from livebass.preset.load import load_preset


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("preset", nargs="?", default="jazz-finger", help="name or file; default: jazz-finger")
    parser.add_argument("recordings", nargs="*", type=Path, help="sound files of single notes, or folders")
    options = parser.parse_args()
    with clear_errors("decay.py"):
        bass = load_preset(options.preset)
        groups = [(bass.name, preset_notes(bass))]
        if options.recordings:
            groups.append(("recordings", recorded_notes(options.recordings, bass)))
    print(table(groups))
    if options.recordings:
        print("of recordings, open is what sounds like an open string: they do not tell their string")


if __name__ == "__main__":
    main()
