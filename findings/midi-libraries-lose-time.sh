#!/usr/bin/env bash
# miditoolkit 1.0.1, pretty_midi 0.2.11.post0, music21 10.5.1, symusic 0.6.0
#
# Guess: a library that reads a MIDI file gives its times, or an error.
# Behaviour: with SMPTE time in the head (25 frames of 40 ticks a second) miditoolkit gives a note of one second an end
# before its beginning, without a word: it takes the division for a negative number of ticks in a quarter note. symusic
# refuses such a file; music21 and pretty_midi raise errors of other kinds. A tempo in a track behind the first one
# counts for symusic and miditoolkit, and is lost in pretty_midi, with a warning, and in music21, without one.
#
# Output seen (the end of the last note, s):
#   SMPTE time: miditoolkit -0.079, pretty_midi ValueError, music21 MidiException, symusic RuntimeError; right is 1
#   tempo in the second track: miditoolkit 1.5, pretty_midi 1, music21 1, symusic 1.5; right is 1.5
set -eu
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet pretty_midi==0.2.11.post0 music21==10.5.1 symusic==0.6.0 miditoolkit==1.0.1 \
    setuptools==80.9.0
cd "$place"
venv/bin/python -W ignore - << 'EOF'
import sys
from pathlib import Path

import miditoolkit
import mido
import music21
import pretty_midi
import symusic


def by_miditoolkit(path):
    song = miditoolkit.MidiFile(path)
    at = song.get_tick_to_time_mapping()
    return max(at[n.end] for track in song.instruments for n in track.notes)


def by_pretty_midi(path):
    return max(n.end for track in pretty_midi.PrettyMIDI(path).instruments for n in track.notes)


def by_music21(path):
    rows = music21.converter.parse(path).flatten().secondsMap
    return max(row["endTimeSeconds"] for row in rows if "Note" in row["element"].classes)


def by_symusic(path):
    return max(n.time + n.duration for track in symusic.Score(path).to("second").tracks for n in track.notes)


def ends(path):
    """The end of the last note of a file by each library, or the name of its error."""
    found = []
    for read in (by_miditoolkit, by_pretty_midi, by_music21, by_symusic):
        try:
            found.append(f"{float(read(path)):.2g}")
        except Exception as error:
            found.append(type(error).__name__)
    return found


def note(key, length):
    return [mido.Message("note_on", note=key, velocity=90), mido.Message("note_off", note=key, time=length)]


mido.MidiFile(ticks_per_beat=480, tracks=[mido.MidiTrack(note(40, 1000))]).save("smpte.mid")
data = bytearray(Path("smpte.mid").read_bytes())
data[12:14] = bytes([256 - 25, 40])  # the division
Path("smpte.mid").write_bytes(data)
tempo = mido.MidiTrack([mido.MetaMessage("set_tempo", tempo=1_000_000, time=480)])
mido.MidiFile(ticks_per_beat=480, tracks=[mido.MidiTrack(note(40, 480) + note(41, 480)), tempo]).save("tempo.mid")
names = "miditoolkit", "pretty_midi", "music21", "symusic"
smpte, later = ends("smpte.mid"), ends("tempo.mid")
print("SMPTE time:", ", ".join(map(" ".join, zip(names, smpte))) + "; right is 1")
print("tempo in the second track:", ", ".join(map(" ".join, zip(names, later))) + "; right is 1.5")
if smpte != ["-0.079", "ValueError", "MidiException", "RuntimeError"] or later != ["1.5", "1", "1", "1.5"]:
    print("changed: the times are others")
    sys.exit(1)
EOF
