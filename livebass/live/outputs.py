"""Audio outputs: a PortAudio device or a JACK client. [main thread]"""

from __future__ import annotations

from livebass.live.guards import silenced_stderr
from livebass.live.jack import JackOutput, jack_library, jack_server, no_server
from livebass.live.portaudio import PortAudioOutput, no_output, sounddevice

Output = PortAudioOutput | JackOutput


def check_output(backend: str, device: int | str | None) -> None:
    """Raises OutputLost if `backend` ("auto", "portaudio", "jack") has no output, before anything is compiled."""
    if backend == "jack":
        jack_library()  # raises if the library is missing
        if not jack_server():
            raise no_server("none answers")
        return
    if backend == "auto" and device is None and jack_server():
        return
    sd = sounddevice()
    try:
        with silenced_stderr():
            sd.query_devices(device, "output")
    except (sd.PortAudioError, ValueError) as error:
        raise no_output(device, error) from None
