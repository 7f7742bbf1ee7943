"""Compares notes of two basses: attack, touch, pitch and decay as players hear them, in numbers.

`measure` gives the figures of a note, `figures` the figures of a bass, `distance` the distance of two notes. To fit a
preset:

    from livebass import QUALITIES, load_preset, render_to_array, single_note
    from livebass.lab.comparison import (
        basses, distance, figures, measure, measure_notes, outside, render_notes, summary, telling
    )

    preset = load_preset("jazz-finger")
    sound = render_to_array(preset, single_note(36, 127, 3.0, 48_000), QUALITIES["studio"]).sum(axis=0)
    note = measure(sound, 48_000, 65.4)
    note["centroid_20"], note["fundamental_fall"]               # Hz and dB; NaN if not shown
    note.missing                                                # {"t60_3200": "no partial ..."}: the reason
    measure(sound, 48_000, 65.4, only=["centroid_20"])          # in a fraction of the time

    real = measure_notes(["tests/recordings/growlybass"])  # the notes of sound files, or folders of them
    ours = render_notes(preset, real, takes=1)                  # the same pitches, velocities over the dynamics
    summary(ours)["hard"]["centroid_20"]                        # median over the hardest notes; "soft", "v78" ...
    (bass,) = basses("mine", ours, rendered=True)               # one for each technique
    outside(figures(bass), bass.technique)                      # {("centroid_20", "hard"): 241.2, ...}, 0 inside
    print(telling([bass], transferred=False).table())           # how well it can be told from real ones
    distance(ours[0].sound, real[0].sound, ours[0].rate, other_rate=real[0].rate)  # dB

`livebass compare` prints all of it, through `compare`.
"""

from livebass.lab.comparison.comparing import Comparison
from livebass.lab.comparison.distance import distance
from livebass.lab.comparison.measures import Measures, measure
from livebass.lab.comparison.notes import Note, measure_notes, render_notes
from livebass.lab.comparison.recordings import compare
from livebass.lab.comparison.rows import ROWS, Row
from livebass.lab.comparison.summary import Bass, Figure, basses, figures, outside, summary
from livebass.lab.comparison.telling import telling

__all__ = [
    "ROWS", "Bass", "Comparison", "Figure", "Measures", "Note", "Row", "basses", "compare", "distance", "figures",
    "measure", "measure_notes", "outside", "render_notes", "summary", "telling",
]  # fmt: skip
