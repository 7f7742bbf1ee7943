"""The recorded note of a real bass: short, and with its licence."""

from __future__ import annotations

from pathlib import Path

from livebass.lab.comparison.notes import measure_notes
from livebass.model.instrument import note_frequency
from livebass.rows.units import cents
from livebass.web.recorded_note import FOLDER, NOTE, recorded_files

MAXIMUM = 150_000  # bytes that the package ships


def test_the_recording_is_short_and_names_its_licence(tmp_path: Path) -> None:
    kept = recorded_files()
    assert sum(map(len, kept.values())) < MAXIMUM and b"CC0 1.0" in kept[f"{FOLDER}/LICENSE.txt"]
    note = tmp_path / "note.flac"
    note.write_bytes(kept[f"{FOLDER}/note.flac"])
    assert abs(cents(measure_notes([note])[0].pitch / note_frequency(NOTE["note"]))) < 10
