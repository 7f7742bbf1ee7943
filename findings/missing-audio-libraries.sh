#!/usr/bin/env bash
# JACK-Client 0.5.7, sounddevice 0.5.3, alsa-midi 1.0.4
#
# Guess: `except ImportError`, or pytest.importorskip, catches an audio package that cannot be used on this machine.
# Behaviour: a package that is installed, but whose C library is not, raises OSError when it is imported. It is not an
# ImportError, so one optional package takes the whole program or test file with it.
#
# Output seen:
#   jack: OSError: JACK library not found
#   sounddevice: OSError: PortAudio library not found
#   alsa_midi: imports
set -eu
case $(uname -s) in Linux) ;; *) echo "only for Linux: the wheels for others bring PortAudio"; exit 2 ;; esac
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet --only-binary :all: JACK-Client==0.5.7 sounddevice==0.5.3 alsa-midi==1.0.4
"$place/venv/bin/python" - << 'EOF'
import ctypes.util
import importlib
import sys

ctypes.util.find_library = lambda name: None  # as on a machine without the C libraries
seen = {}
for name in ("jack", "sounddevice", "alsa_midi"):
    try:
        importlib.import_module(name)
        seen[name] = "imports"
    except Exception as error:
        seen[name] = f"{type(error).__name__}: {error}"
    print(f"{name}: {seen[name]}")
if not all(seen[name].startswith("OSError") for name in ("jack", "sounddevice")):
    print("changed: the import raises something else")
    sys.exit(1)
EOF
