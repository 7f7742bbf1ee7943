#!/usr/bin/env bash
# supriya-midi 26.10b4 (RtMidi 6.1.0)
#
# Guess: a method that raises RtMidiError for a wrong call raises it each time.
# Behaviour: the error function of supriya-midi raises within RtMidi, which sets a mark while it reports an error and
# never takes it away then. So only the first error of an object is raised; every later one passes in silence, such as a
# port that could not be opened. An error function of your own that only keeps the error is called each time.
#
# Output seen:
#   default: raised, silent, silent
#   own function: reported, reported, reported
set -eu
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet --only-binary :all: supriya-midi==26.10b4
"$place/venv/bin/python" - 2> "$place/said" << 'EOF'
import sys

try:
    import supriya_midi
except ImportError as error:
    print(f"a library is missing: {error}; on Debian: sudo apt install libasound2")
    sys.exit(2)


def cancel(port):
    """Cancels a callback that was never set, which is an error."""
    try:
        port.cancel_callback()
    except supriya_midi.RtMidiError:
        return "raised"
    return "silent"


api = supriya_midi.RtMidiAPI.RTMIDI_DUMMY  # needs no sound card
port = supriya_midi.MidiIn(api, "finding")
default = [cancel(port) for _ in range(3)]
print("default:", ", ".join(default))
own, errors, seen = supriya_midi.MidiIn(api, "finding"), [], []
own.set_error_callback(lambda kind, text, data: errors.append(text))
for _ in range(3):
    errors.clear()
    cancel(own)
    seen.append("reported" if errors else "silent")
print("own function:", ", ".join(seen))
if default != ["raised", "silent", "silent"] or seen != ["reported"] * 3:
    print("changed: later errors are raised, too")
    sys.exit(1)
EOF
