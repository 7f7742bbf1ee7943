"""Plays dense random notes for minutes while Python is busy; prints lost frames, faults, stuck notes, growth of memory.

    python tools/endurance.py [--minutes 10] [--seed 1]

Starts a JACK server of its own with the dummy driver (Debian: jackd2). While notes are played, no more frames may be
lost than in the phases without notes, and half of that for chance. The exit status is 1 if a check fails, or if the
phases without notes lose too much to tell. The phases are described in livebass/bench/endurance.py.
"""

from __future__ import annotations

import argparse
import logging
import signal
import sys

from livebass.bench.endurance import endurance


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=10.0, help="of playing; default: 10")
    parser.add_argument("--seed", type=int, default=1, help="of the random notes; default: 1")
    options = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(message)s", stream=sys.stdout)
    logging.root.handlers[0].addFilter(lambda record: not record.getMessage().startswith("preset"))
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that the server is ended too
    try:
        return 0 if endurance(60.0 * options.minutes, options.seed, lambda line: print(line, flush=True)) else 1
    except OSError as error:
        print(f"endurance: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
