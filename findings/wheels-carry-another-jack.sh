#!/usr/bin/env bash
# supriya-midi 26.10b4 (RtMidi 6.1.0), JACK-Client 0.5.7, jackd2 1.9.21 of Debian 12
#
# Guess: a MIDI library whose wheel lists JACK among its systems finds the JACK server that runs.
# Behaviour: the wheel brings its own libjack (1.9.14, protocol 8). A server of Debian 12 (1.9.21, protocol 9) refuses
# it, and the library says that no server runs. JACK-Client loads the system's libjack and finds the server. A wheel's
# own libjack cannot be replaced by pw-jack, either, which sets LD_LIBRARY_PATH: its file has another name. The wheels of
# rtmidi2 1.5.0 and pylibremidi 5.4.3 carry the same libjack.
#
# Output seen:
#   JACK-Client: server at 48000 Hz, library 1.9.21
#   supriya-midi lists: LINUX_ALSA, UNIX_JACK, RTMIDI_DUMMY
#   supriya-midi: MidiInJack::initialize: JACK server not running?
#   its libjack: libjack-47d4404a.so.0.1.0
set -eu
command -v jackd > /dev/null || { echo "jackd is missing: sudo apt install jackd2"; exit 2; }
place=$(mktemp -d)
server=
finish() {
  if [ -n "$server" ]; then kill "$server" 2> /dev/null || true; wait "$server" 2> /dev/null || true; fi
  rm -rf "$place"
}
trap finish EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet --only-binary :all: supriya-midi==26.10b4 JACK-Client==0.5.7
export JACK_DEFAULT_SERVER="finding-$$" JACK_NO_AUDIO_RESERVATION=1
jackd --no-realtime -n "$JACK_DEFAULT_SERVER" -d dummy -r 48000 -p 256 > /dev/null 2>&1 &
server=$!
"$place/venv/bin/python" - 2> "$place/said" << 'EOF'
import os
import sys
import time
from pathlib import Path

try:
    import jack
    import supriya_midi
except (ImportError, OSError) as error:
    print(f"a library is missing: {error}")
    sys.exit(2)
for _ in range(100):
    try:
        client = jack.Client("finding", no_start_server=True)
        break
    except jack.JackError:
        time.sleep(0.1)
else:
    print("jackd does not start here")
    sys.exit(2)
print(f"JACK-Client: server at {client.samplerate} Hz, library {jack.version_string()}")
print("supriya-midi lists:", ", ".join(api.name for api in supriya_midi.get_compiled_apis()))
try:
    supriya_midi.MidiIn(supriya_midi.RtMidiAPI.UNIX_JACK, "finding-too").get_ports()
    found = True
except (RuntimeError, supriya_midi.RtMidiError) as error:
    found = False
    print("supriya-midi:", error)
for file in sorted(Path(supriya_midi.__file__).parent.parent.glob("supriya_midi*/libjack*")):
    print("its libjack:", file.name)
sys.stdout.flush()
if found:
    print("changed: the wheel's libjack reaches this server", flush=True)
os._exit(1 if found else 0)  # the library may hang in a process whose server ends
EOF
