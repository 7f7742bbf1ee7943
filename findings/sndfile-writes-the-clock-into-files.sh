#!/usr/bin/env bash
# soundfile 0.14.0 (libsndfile 1.2.2)
#
# Guess: the same samples, written twice in the same format, give the same bytes, as no date was asked for.
# Behaviour: in float WAV, WAVEX and AIFF libsndfile writes the time, in seconds, into a chunk PEAK. It takes the serial
# number of an Ogg stream from the clock; that number is in the head of every page and changes the page's checksum.
# Integer WAV, FLAC, float CAF and MP3 are the same each time. To compare or reproduce such files, read their samples, or
# write another serial number and no PEAK (command SFC_SET_ADD_PEAK_CHUNK, which soundfile lacks).
#
# Output seen, in two processes 1.1 s apart:
#   WAV PCM_16: the same
#   WAV FLOAT: differs at bytes 60 to 60
#   WAVEX FLOAT: differs at bytes 84 to 84
#   OGG VORBIS: differs at bytes 14 to 3675
#   OGG OPUS: differs at bytes 14 to 894
#   FLAC PCM_16: the same
#   AIFF FLOAT: differs at bytes 71 to 71
#   CAF FLOAT: the same
#   MP3 MPEG_LAYER_III: the same
set -eu
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet --only-binary :all: soundfile==0.14.0 numpy==2.4.6
cat > "$place/write.py" << 'EOF'
import sys

import numpy as np
import soundfile

samples = 0.5 * np.sin(2 * np.pi * 110 / 48000 * np.arange(24000))
for written in sys.argv[2:]:
    kind, subtype = written.split(":")
    soundfile.write(f"{sys.argv[1]}-{written}", samples, 48000, format=kind, subtype=subtype)
EOF
kinds="WAV:PCM_16 WAV:FLOAT WAVEX:FLOAT OGG:VORBIS OGG:OPUS FLAC:PCM_16 AIFF:FLOAT CAF:FLOAT MP3:MPEG_LAYER_III"
"$place/venv/bin/python" "$place/write.py" "$place/first" $kinds
sleep 1.1
"$place/venv/bin/python" "$place/write.py" "$place/second" $kinds
differ=
for kind in $kinds; do
    if changed=$(cmp -l "$place/first-$kind" "$place/second-$kind"); then
        echo "${kind/:/ }: the same"
    else
        places=$(awk '{print $1 - 1}' <<< "$changed")
        echo "${kind/:/ }: differs at bytes $(head -1 <<< "$places") to $(tail -1 <<< "$places")"
        differ="$differ $kind"
    fi
done
case "$differ " in
    *" WAV:FLOAT "*" OGG:VORBIS "*) ;;
    *)
        echo "changed: float WAV and Ogg are the same each time"
        exit 1
        ;;
esac
