#!/usr/bin/env bash
# python-rtmidi 1.5.8 (RtMidi 5.0.0), JACK-Client 0.5.7, jackd2 1.9.21 of Debian 12
#
# Guess: the time stamps of a JACK MIDI input tell when each message was played.
# Behaviour: JACK gives each message a place in its period. RtMidi drops it and takes the time at which its own callback
# reads the message: two notes that are 5 ms apart come 0.1 ms apart, and a note's time is late by up to a period,
# whatever the delay. A client that reads `time` of jack_midi_event_t itself has the exact frame. Two messages that a
# client writes as one event come as one list of six bytes.
#
# Output seen (48 kHz, period 256):
#   sent at frames 0 and 240 of a period, 5.00 ms apart
#   heard [144, 1, 1] and [144, 2, 1], 0.15 ms apart
#   two messages in one event: [[144, 1, 1, 144, 2, 1]]
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
"$place/venv/bin/pip" install --quiet --only-binary :all: python-rtmidi==1.5.8 JACK-Client==0.5.7 ||
  { echo "python-rtmidi 1.5.8 has no wheel for this Python: take 3.11 or 3.12"; exit 2; }
export JACK_DEFAULT_SERVER="finding-$$" JACK_NO_AUDIO_RESERVATION=1
jackd --no-realtime -n "$JACK_DEFAULT_SERVER" -d dummy -r 48000 -p 256 > /dev/null 2>&1 &
server=$!
"$place/venv/bin/python" - 2> "$place/said" << 'EOF'
import os
import sys
import time

try:
    import jack
    import rtmidi
except (ImportError, OSError) as error:
    print(f"a library is missing: {error}")
    sys.exit(2)
for _ in range(100):
    try:
        source = jack.Client("finding", no_start_server=True)
        break
    except jack.JackError:
        time.sleep(0.1)
else:
    print("jackd does not start here")
    sys.exit(2)
port, periods, heard = source.midi_outports.register("out"), [], []


def process(_frames):
    port.clear_buffer()
    for place, message in periods.pop(0) if periods else []:
        port.write_midi_event(place, message)


source.set_process_callback(process)
source.activate()
listener = rtmidi.MidiIn(rtapi=rtmidi.API_UNIX_JACK, name="listener")
listener.set_callback(lambda event, _data: heard.append(event))
listener.open_port(listener.get_ports().index("finding:out"))


def through(period, count):
    """What comes of a period's messages; a busy server may lose some, so it tries again."""
    for _ in range(20):
        heard.clear()
        periods.append(period)
        time.sleep(0.3)
        if len(heard) == count:
            return list(heard)
    print("the messages do not come through")
    os._exit(2)


(first, _), (second, apart) = through([(0, (0x90, 1, 1)), (240, (0x90, 2, 1))], 2)
sent = 240 / source.samplerate
print(f"sent at frames 0 and 240 of a period, {1e3 * sent:.2f} ms apart")
print(f"heard {first} and {second}, {1e3 * apart:.2f} ms apart")
both = [message for message, _ in through([(0, (0x90, 1, 1, 0x90, 2, 1))], 1)]
print("two messages in one event:", both, flush=True)
changed = abs(apart - sent) < 0.1 * sent or both != [[0x90, 1, 1, 0x90, 2, 1]]
if changed:
    print("changed: the places in a period are kept, or the messages come one by one", flush=True)
os._exit(1 if changed else 0)  # the library may hang in a process whose server ends
EOF
