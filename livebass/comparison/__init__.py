"""Compares notes of a bass with notes of another: what players hear of attack, touch, pitch and decay, in numbers.

`measure` gives the figures of one note, and `distance` how far two notes are apart. To fit a preset:

    from livebass import QUALITIES, load_preset, render_to_array, single_note
    from livebass.comparison import distance, measure

    bass = load_preset("jazz-finger")
    sound = render_to_array(bass, single_note(36, 127, 3.0, 48_000), QUALITIES["studio"]).sum(axis=0)
    figures = measure(sound, 48_000, 65.4)
    figures["centroid_20"], figures["fundamental_fall"]         # Hz and dB; NaN where the note does not tell
    figures.missing                                             # {"level_2s": "2.1 s: is shorter"}: why it does not

    real = measured(["a-folder-of-notes"])                      # a note for each sound file
    ours = rendered("jazz-finger", real)                        # the same pitches, velocities over the dynamics
    summary(ours)["hard"]["centroid_20"]                        # median over the notes
    distance(ours[0].sound, real[0].sound)                      # dB
"""

from livebass.comparison.distance import distance
from livebass.comparison.measures import Measures, measure
from livebass.comparison.notes import Note, measured, rendered
from livebass.comparison.summary import summary

__all__ = ["Measures", "Note", "distance", "measure", "measured", "rendered", "summary"]
