"""A bass behind PortAudio's JACK host and a JACK MIDI port, for `bench latency` to measure from outside.

`python -m livebass.lab.bench.player PRESET QUALITY RATE BLOCK` plays until its standard input ends. It is a separate
process because PortAudio looks for JACK only once, when loaded, and closing a stream whose server has gone never
returns: so it exits without closing, and its time is limited.
"""

from __future__ import annotations

import os
import sys
import threading
from typing import Any

from livebass.lab.bench.jack import end_after
from livebass.live.device_errors import OutputLost
from livebass.live.jackmidi import JackMidi
from livebass.live.portaudio import PortAudioOutput
from livebass.live.synth import LiveBass, Synth
from livebass.live.worst import even
from livebass.model.quality import QUALITIES
from livebass.preset.load import load_preset
from livebass.system.extras import install

NAME = "livebass-bench"  # of the JACK client that holds the MIDI input
LONGEST = 240.0  # s
HOST = "JACK Audio Connection Kit"


def main() -> None:
    """Plays; if something is missing, one line on stderr and status 1."""
    preset, quality, rate, block = sys.argv[1:]
    end_after(LONGEST)
    watch = threading.Thread(target=_exit_with_parent)
    watch.start()
    try:
        held = _play(preset, quality, int(rate), int(block))
    except (OSError, ValueError, LookupError) as error:
        print(" ".join(str(error).split()), file=sys.stderr, flush=True)
        os._exit(1)
    watch.join()
    del held


def _exit_with_parent() -> None:
    sys.stdin.read()
    os._exit(0)


def _play(preset: str, quality: str, rate: int, block: int) -> Any:
    """Starts the bass; keep the returned objects while it plays."""
    try:
        import sounddevice
    except (ImportError, OSError) as error:
        raise OutputLost(f"{error}; {install('live')}") from None
    device = next((h["default_output_device"] for h in sounddevice.query_hostapis() if h["name"] == HOST), -1)
    if device < 0:
        raise OutputLost("this PortAudio has no JACK host")
    synth = Synth(rate)
    synth.switch_to(LiveBass(even(load_preset(preset)), QUALITIES[quality], rate))
    output = PortAudioOutput(synth, device, block, "low")
    midi = JackMidi(NAME)
    midi.synth, midi.delay = synth, block
    output.start()
    midi.open_virtual()
    return output, midi


if __name__ == "__main__":
    main()
