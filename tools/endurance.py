"""Plays dense random notes for minutes while Python is busy; prints lost frames, faults, stuck notes, memory growth.

    python tools/endurance.py [--minutes 10] [--seed 1]

Starts its own JACK server with the dummy driver (Debian: jackd2). The phases with notes may lose at most the frames
that the phases without notes lose, plus half as many for chance. The exit status is 1 if a check fails, or if the
phases without notes lose too many frames to tell. livebass/bench/endurance.py describes the phases.
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
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # this also ends the server
    try:
        return 0 if endurance(60.0 * options.minutes, options.seed, lambda line: print(line, flush=True)) else 1
    except OSError as error:
        print(f"endurance: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
