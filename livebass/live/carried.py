"""The quality that this machine carries: `studio` where its worst block leaves time to spare, else `live`.

Measured when a bass is first played here, in one or two seconds, and kept in a file of the user's directory for
compiled code: by the bass, its rate, the kernels, the kind of processor and the machine's name.
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
MOST = 0.6  # of a block's time that the worst one may take: effects and the rest of the machine need the others
BLOCK = 64  # frames
RUNS = 4  # of which each block counts as the quickest: other programs hold blocks up ...
FAR = 2 * MOST  # ... or one, if its worst block takes more than that
SHARE = struct.Struct("<d")  # content of a file
ENOUGH = 5.0  # s that measuring several basses may take: another one is not begun then


def prepared(instrument: Instrument, quality: Quality | None, rate: int) -> LiveBass:
    """Prepares a bass in a `quality`, or in the one that this machine carries. Raises what `LiveBass` raises.

    [any thread but the audio thread]
    """
    if quality is not None:
        return LiveBass(instrument, quality, rate)
    fine = LiveBass(instrument, QUALITIES[FINE], rate)
    return fine if kept_share(fine) <= MOST else LiveBass(instrument, QUALITIES[LIGHT], rate)


def best_qualities(basses: Mapping[str, Instrument], rate: int, enough: float = ENOUGH) -> dict[str, str]:
    """The qualities that this machine carries, by name: of the first basses, or known; `live` for all others."""
    found, began = {}, time.monotonic()
    for name, instrument in basses.items():
        bass = LiveBass(instrument, QUALITIES[FINE], rate)
        share = kept_share(bass) if time.monotonic() < began + enough else _known_share(bass)
        found[name] = FINE if share is not None and share <= MOST else LIGHT
    return found


def kept_share(bass: LiveBass, measure: Callable[[LiveBass], float] | None = None) -> float:
    """Returns the part of its time that the worst block of `bass` takes here: as kept, or measured, and then kept."""
    known = _known_share(bass)
    if known is not None:
        return known
    path, share = _file(bass), (measure or worst_share)(bass)
    if path:
        with suppress(OSError):
            store.write(path, SHARE.pack(share))
    return share


def _known_share(bass: LiveBass) -> float | None:
    """Returns what `kept_share` has kept; None if it has to be measured."""
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
    """The file that may hold the share of a bass; None if there can be none."""
    place = store.directory(f"loads-{store.digest()}")
    of = hashlib.sha256(bass.engine.image.words.tobytes())
    of.update(f"{bass.engine.rate} {store.level()} {platform.node()} {platform.processor()}".encode())
    return place / of.hexdigest()[:16] if place else None
