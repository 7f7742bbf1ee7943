"""The best quality for this machine: `studio` if its worst block leaves time to spare, else `live`.

Measured in one or two seconds when a bass is first played here, and kept in a file in the user's directory for
compiled code. The key is the bass, its rate, the kernels, the kind of processor and the machine's name.
"""

from __future__ import annotations

import hashlib
import platform
import struct
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from livebass.compiling import store
from livebass.live.synth import LiveBass
from livebass.live.worst import block_times, even, worst_case
from livebass.model.instrument import Instrument
from livebass.model.quality import QUALITIES, Quality

FINE, LIGHT = "studio", "live"
MAXIMUM = 0.6  # of a block's time that the worst one may take: effects and the rest of the machine need the remainder
BLOCK = 64  # frames
RUNS = 4  # the quickest of these counts for each block: other programs delay blocks ...
FAR = 2 * MAXIMUM  # ... or one run, if its worst block takes more than this
SHARE = struct.Struct("<d")  # the content of a file
ENOUGH = 5.0  # s for measuring several basses: past it no other one is begun


def prepare_bass(instrument: Instrument, quality: Quality | None, rate: int) -> LiveBass:
    """Prepares a bass in a `quality`, or the best for this machine. Raises the errors of `LiveBass`.

    [any thread but the audio thread]
    """
    if quality is not None:
        return LiveBass(instrument, quality, rate)
    fine = LiveBass(instrument, QUALITIES[FINE], rate)
    return fine if kept_share(fine) <= MAXIMUM else LiveBass(instrument, QUALITIES[LIGHT], rate)


def best_qualities(basses: Mapping[str, Instrument], rate: int, enough: float = ENOUGH) -> dict[str, str]:
    """The best qualities for this machine, by name: measured for the first basses, or known; `live` for the others."""
    found, began = {}, time.monotonic()
    for name, instrument in basses.items():
        bass = LiveBass(instrument, QUALITIES[FINE], rate)
        share = kept_share(bass) if time.monotonic() < began + enough else _known_share(bass)
        found[name] = FINE if share is not None and share <= MAXIMUM else LIGHT
    return found


def kept_share(bass: LiveBass, measure: Callable[[LiveBass], float] | None = None) -> float:
    """Returns the part of its time that the worst block of `bass` takes here, from the file, else measured and kept."""
    known = _known_share(bass)
    if known is not None:
        return known
    path, share = _file(bass), (measure or worst_share)(bass)
    if path:
        with suppress(OSError):
            store.write(path, SHARE.pack(share))
    return share


def _known_share(bass: LiveBass) -> float | None:
    """Returns the share that `kept_share` has stored; None if it must be measured."""
    path = _file(bass)
    data = store.whole(path) if path else None
    return float(SHARE.unpack(data)[0]) if data is not None and len(data) == SHARE.size else None


def worst_share(bass: LiveBass) -> float:
    """Measures the part of its time that the worst block of a bass like `bass` takes, on one core."""
    engine = bass.engine
    script = worst_case(engine.instrument, engine.rate, len(engine.instrument.strings), line=0.0)
    for runs in (1, RUNS):
        times = block_times(even(engine.instrument), QUALITIES[FINE], BLOCK, script, runs)
        share = float(times.min(axis=0).max()) * 1e-9 * engine.rate / BLOCK
        if share > FAR:
            break
    return share


def _file(bass: LiveBass) -> Path | None:
    """The file for a bass's share; None if it has no place."""
    place = store.directory(f"loads-{store.digest()}")
    of = hashlib.sha256(bass.engine.image.words.tobytes())
    of.update(f"{bass.engine.rate} {store.level()} {platform.node()} {platform.processor()}".encode())
    return place / of.hexdigest()[:16] if place else None
