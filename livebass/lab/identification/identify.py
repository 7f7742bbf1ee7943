"""Identifies a plucked open string from recordings.

Follows section 3.2 of C. Issanchou et al. (2018): finds frequencies and dampings of the partials by a high-resolution
method over several takes, then fits the models of section 2.2.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Unpack

from livebass.lab.identification.across import level_across
from livebass.lab.identification.common_partials import alone, cut_fades, find_partials, steady
from livebass.lab.identification.doubts import doubtful
from livebass.lab.identification.limits import Search, Searching
from livebass.lab.identification.onset import fit_onset, third_octaves
from livebass.lab.identification.partials import combine
from livebass.lab.identification.result import Identified, identified_string, laws_of, nearest_string, tune_string
from livebass.lab.identification.takes import takes_of
from livebass.model.instrument import Instrument, String, note_frequency, speaking


def identify(
    recordings: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    bass: Instrument,
    *,
    string: str | None = None,
    only_string: bool = False,
    **search: Unpack[Searching],
) -> Identified:
    """Identifies a string from recordings in which it is plucked open and alone.

    Needs SciPy: ``pip install 'livebass[analysis]'``. Call it in the main thread.

    Args:
        recordings: One or several sound files. Each of their notes is used.
        bass: Its strings are the guesses to start from.
        string: Name of the string in `bass`; by default the one tuned nearest.
        only_string: Keep pluck, pickups and tone of `bass`.

    Keyword Args:
        note: MIDI note of the open string; found by default.
        f0: Its frequency to a semitone, Hz, instead of `note`.
        modes: Highest number of partials to look for (60).
        start: Start of the part of a note that is used, s after its attack (0.02).
        duration: Greatest length of that part, s (5).
        channel: Channel of the files, from 1; by default the loudest.

    Raises:
        ValueError: A value out of its limits; as RecordingError, recordings that cannot be used.
    """
    requested = Search(**search)
    paths = [Path(r) for r in ([recordings] if isinstance(recordings, str | os.PathLike) else recordings)]
    known = None if string is None else _string(bass, string)
    takes = takes_of(paths, requested, _hint(requested, known))
    heard = find_partials(takes, requested.modes)
    for step in (steady, cut_fades, alone):
        heard = step(heard)
    found = combine([note.partials for note in heard.notes])
    base = known or nearest_string(bass, takes.pitch)
    strange, doubts = doubtful(found, base, laws_of(found, base)[0])
    found = [p for p in found if p.number not in strange]
    heard = replace(heard, doubts=(*heard.doubts, *doubts))
    laws, neck = laws_of(found, base), bass.necks[bass.strings.index(base)]
    fitted, level = tune_string(base, laws[0], requested.note), level_across(bass, base.name)
    result = identified_string(fitted, neck, laws, found, level, heard, takes.all_takes - len(heard.notes))
    if only_string:
        return result
    bands = third_octaves(result.takes)
    return replace(result, onset=fit_onset(speaking(result.string, neck, 0), bass, found, bands, requested.start))


def _string(bass: Instrument, name: str) -> String:
    """The string of that name; raises ValueError, which lists the bass's strings."""
    try:
        return bass.strings[bass.string_index(name)]
    except LookupError as error:
        raise ValueError(error.args[0]) from None


def _hint(search: Search, string: String | None) -> float | None:
    """The pitch to look for, Hz, or None."""
    if search.f0 or search.note is not None:
        return search.f0 or note_frequency(search.note or 0)
    return None if string is None else string.frequency(string.open_note)
