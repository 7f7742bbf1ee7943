#!/usr/bin/env bash
# pretty_midi 0.2.11.post0, music21 10.5.1, symusic 0.6.0, miditoolkit 1.0.1
#
# Guess: of two notes of one key that overlap on one channel, a note-off ends one: the first that began.
# Behaviour: so do symusic and miditoolkit. pretty_midi and music21 end both notes at the first note-off and ignore the
# second one. And where a note begins again at the very tick at which the one before ends, and its note-on stands first
# in the file, music21 gives the second note no length.
#
# Output seen (beginnings and ends in s):
#   overlap: pretty_midi 0-0.75 0.5-0.75, music21 0-0.75 0.5-0.75, symusic 0-0.75 0.5-1, miditoolkit 0-0.75 0.5-1
#   at once: pretty_midi 0-0.5 0.5-1, music21 0-0.5 0.5-0.5, symusic 0-0.5 0.5-1, miditoolkit 0-0.5 0.5-1
set -eu
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet pretty_midi==0.2.11.post0 music21==10.5.1 symusic==0.6.0 miditoolkit==1.0.1 \
    setuptools==80.9.0
cd "$place"
venv/bin/python -W ignore - << 'EOF'
import sys

import miditoolkit
import mido
import music21
import pretty_midi
import symusic

SONGS = {  # ticks, 480 in half a second: note-ons and note-offs of one key
    "overlap": [(0, "note_on"), (480, "note_on"), (720, "note_off"), (960, "note_off")],
    "at once": [(0, "note_on"), (480, "note_on"), (480, "note_off"), (960, "note_off")],
}
SEEN = {
    "overlap": ["0-0.75 0.5-0.75", "0-0.75 0.5-0.75", "0-0.75 0.5-1", "0-0.75 0.5-1"],
    "at once": ["0-0.5 0.5-1", "0-0.5 0.5-0.5", "0-0.5 0.5-1", "0-0.5 0.5-1"],
}


def by_pretty_midi(path):
    return [(n.start, n.end) for track in pretty_midi.PrettyMIDI(path).instruments for n in track.notes]


def by_music21(path):
    rows = music21.converter.parse(path).flatten().secondsMap
    return [(row["offsetSeconds"], row["endTimeSeconds"]) for row in rows if "Note" in row["element"].classes]


def by_symusic(path):
    return [(n.time, n.time + n.duration) for track in symusic.Score(path).to("second").tracks for n in track.notes]


def by_miditoolkit(path):
    song = miditoolkit.MidiFile(path)
    at = song.get_tick_to_time_mapping()
    return [(at[n.start], at[n.end]) for track in song.instruments for n in track.notes]


found = {}
for name, events in SONGS.items():
    track, last = mido.MidiTrack(), 0
    for tick, kind in events:
        track.append(mido.Message(kind, note=40, velocity=90, time=tick - last))
        last = tick
    mido.MidiFile(ticks_per_beat=480, tracks=[track]).save("song.mid")
    found[name] = []
    for read in (by_pretty_midi, by_music21, by_symusic, by_miditoolkit):
        rows = sorted((float(begin), float(end)) for begin, end in read("song.mid"))
        found[name].append(" ".join(f"{begin:g}-{end:g}" for begin, end in rows))
    names = "pretty_midi", "music21", "symusic", "miditoolkit"
    print(f"{name}:", ", ".join(f"{own} {rows}" for own, rows in zip(names, found[name])))
if found != SEEN:
    print("changed: notes end elsewhere")
    sys.exit(1)
EOF
