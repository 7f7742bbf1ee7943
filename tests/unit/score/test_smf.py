"""The reader of MIDI files: what it finds in thousands of made-up and damaged ones, compiled and as plain Python."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from support.plain import in_plain_python
from support.smf import END, smf
from support.songs import damaged, digests, make

from livebass.compiling import PLAIN
from livebass.kernels.score import smf as codes
from livebass.kernels.score.lines import MAX_PARTS
from livebass.score.reading import ScoreError, score_in
from livebass.score.sentences import ERRORS, REMARKS
from livebass.score.smf import SmfError, parse_smf

MADE, DAMAGED, TOGETHER = 1500, 3000, 250
FEW = range(12)  # files for plain Python, which is slow
PINNED = [
    "b55a4b08", "850c71c7", "62f819fe", "db9980f3", "24f210a3", "cb5807ba", "5a6daa4c", "f115b8c2",
    "9098f9ad", "a6b8a99f", "71078911", "5573cf86",
]  # fmt: skip
RARE = [
    f"has {{3}} events, more than {codes.MAX_EVENTS}",
    "track {0} of {1}, byte {2}: system message of {3} bytes, {4} left: the file is truncated or damaged",
    "track {0} of {1}, byte {2}: system exclusive length longer than 4 bytes",
]


def test_whole_files_have_the_messages_that_were_put_in() -> None:
    found = 0
    for seed in range(MADE):
        data, kind, tracks = make(seed)
        try:
            smf = parse_smf(data)
        except SmfError:
            continue
        if data.startswith(b"RIFF") or kind == 2:  # of patterns one plays; the RIFF file may be cut
            continue
        found += 1
        rows = sorted(((track, row) for track, rows in enumerate(tracks) for row in rows), key=lambda r: r[1][0])
        assert [(track, (tick, *message)) for tick, track, _, *message in smf.rows.tolist()] == rows, seed
    assert found > MADE // 2


def test_damaged_files_read_as_they_did() -> None:
    """The digests are of another reader, in Python, with which this one agreed."""
    assert digests(map(damaged, range(DAMAGED)), TOGETHER) == PINNED


def test_each_error_and_remark_has_a_sentence_and_occurs() -> None:
    """All but these occur in the made-up and damaged files, in their words."""
    parts = range(codes.MESSAGE_DATA + 1)
    assert set(ERRORS) >= {*range(1, codes.TOO_MANY + 1), *(codes.CUT + part for part in parts)}
    assert set(REMARKS) == set(range(codes.PATTERNS + 1))
    files = [b"", b"abc", *(make(seed).data for seed in range(MADE)), *map(damaged, range(DAMAGED))]
    said = "\n".join(line for data in files for line in lines(data))
    sentences = [text for of in (*ERRORS.values(), *REMARKS.values()) for text in ([of] if isinstance(of, str) else of)]
    assert [text for text in sentences if not re.search(f"^{pattern(text)}$", said, re.M)] == RARE


@pytest.mark.parametrize("event", [b"\0\x90\x28\x40", b"\0\xff\x51\x03\x07\xa1\x20", b"\0\xf0\0", b"\0\xff\x06\0"])
def test_a_file_of_too_many_events_is_refused(event: bytes) -> None:
    """A score takes up to 400 bytes for an event: a file of 4 MB filled gigabytes."""
    assert lines(smf(event * codes.MAX_EVENTS)) == ()
    count = codes.MAX_EVENTS + 1
    assert lines(smf(event, event * codes.MAX_EVENTS)) == (f"has {count} events, more than {codes.MAX_EVENTS}",)


@pytest.mark.parametrize("tracks", [200, MAX_PARTS + 1])
def test_events_that_tracks_on_one_channel_share_are_counted(tracks: int) -> None:
    """A controller goes to each track there that has a program of its own."""
    own = (b"\0\xc0" + bytes([k % 100]) + b"\0\x90\x28\x40\x01\x80\x28\0" + END for k in range(tracks))
    shared = b"\0\xb0\x07\x64" * (2 * codes.MAX_EVENTS // tracks)
    with pytest.raises(ScoreError, match="its tracks share channels"):
        score_in(smf(shared, *own), Path("song.mid"), 48000)


def lines(data: bytes) -> tuple[str, ...]:
    """The error or the remarks of a file."""
    try:
        return parse_smf(data).warnings
    except SmfError as error:
        return (str(error),)


def pattern(text: str) -> str:
    """A pattern for a sentence with any numbers."""
    return re.sub(r"\\\{\d(:02X)?\\\}", r"[0-9A-F]+", re.escape(text))


def test_plain_kernels_read_the_same() -> None:
    assert in_plain_python(__file__) == few()


def few() -> list[str]:
    """Digests of some made-up and damaged files."""
    return digests([file for seed in FEW for file in (make(seed).data, damaged(seed))], 1)


if __name__ == "__main__":
    assert PLAIN
    print(json.dumps(few()))
