"""Kinds of files, recognized by their first bytes."""

from __future__ import annotations

import io
import re
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
import soundfile

import livebass
from livebass.files.kinds import HEAD, MIDI_ENDINGS, TAB_ENDINGS, kind_of
from livebass.web.words import WORDS


def _zip(*names: str, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", method) as file:
        for name in names:
            file.writestr(name, f"content of {name}" * 40)
    return made.getvalue()


def _sound(format: str, subtype: str | None = None) -> bytes:
    made = io.BytesIO()
    soundfile.write(made, np.sin(np.arange(4800) / 10), 48_000, format=format, subtype=subtype)
    return made.getvalue()


XML = '<?xml version="1.0" encoding="{0}"?>\n<!-- <html> is not meant -->\n<score-timewise version="4.0">'
KINDS = {
    "a MIDI file": [b"MThd\0\0\0\6", b"RIFF\x94\0\0\0RMIDdata", b"\0\4name" + bytes(122) + b"MThd\0\0\0\6"],
    "a MIDI 2.0 clip file": [b"SMF2CLIP" + bytes(16)],
    "a Sibelius file": [b"\x0fSIBELIUS\0\0"],
    "an FL Studio project": [b"FLhd\6\0\0\0\0\0"],
    "a REAPER project": [b'<REAPER_PROJECT 0.1 "7.0/linux" 1\n'],
    "a WAV file": [_sound("WAV"), _sound("RF64"), b"RIFF\xff\xff\xff\xffWAVEfmt "],
    "an AIFF file": [_sound("AIFF")],
    "a FLAC file": [_sound("FLAC")],
    "an Ogg Vorbis file": [_sound("OGG")],
    "an Opus file": [_sound("OGG", "OPUS")],
    "a CAF file": [_sound("CAF")],
    "an AU file": [_sound("AU")],
    "an MP3 file": [_sound("MP3"), b"ID3\4\0\0\0\0\0\0", b"\xff\xf3\x48\xc4"],
    "an AAC file": [b"\xff\xf1\x50\x80\x02\x1f\xfc", b"\xff\xf9\x50\x80"],
    "an M4A file": [b"\0\0\0\x20ftypM4A \0\0\2\0"],
    "an MP4 file": [b"\0\0\0\x20ftypisom\0\0\2\0"],
    "a QuickTime video": [b"\0\0\0\x14ftypqt  \0\0\2\0"],
    "a WebM file": [b"\x1aE\xdf\xa3\x9fB\x86\x81\1B\xf7\x81\1B\xf2\x81\4B\xf3\x81\x08B\x82\x84webm"],
    "a Matroska file": [b"\x1aE\xdf\xa3\x9fB\x86\x81\1B\xf7\x81\1B\x82\x88matroska"],
    "a Windows Media file": [bytes.fromhex("3026b2758e66cf11a6d900aa0062ce6c")],
    "a Guitar Pro 3 file": [b"\x18FICHIER GUITAR PRO v3.00" + bytes(6)],
    "a Guitar Pro 4 file": [b"\x18FICHIER GUITAR PRO v4.06" + bytes(6)],
    "a Guitar Pro 5 file": [b"\x18FICHIER GUITAR PRO v5.10" + bytes(6)],
    "a Guitar Pro 6 file": [b"BCFZ\0\0\1\0", b"BCFS\0\0\0\0"],
    "a Guitar Pro 7 file": [_zip("VERSION", "Content/score.gpif"), _zip("Content/BinaryStylesheet", "x")],
    "a text tab": [
        b"Riff, tuned DADG\n\nG|-----|\nD|-5p3-|\nA|-----5-|\nE|-----|\n",
        "> G|––––7–|\r\n> D|––5–––|\r\n> A|––––––|\r\n> D|–10–––|".encode(),
        b"x\ng ---2---\nd ---2---\na -0-----\n", "e:─3─\nB:─3─\nG:─0─".encode("utf-16"),
        b"|-------0h2-|\n|---0-2-----|\n|-3---------|\n",
    ],
    "a TuxGuitar file": [b"\x1b" + "TuxGuitar File Format - 1.5".encode("utf-16-be")],
    "a MusicXML file": [
        XML.format("UTF-8").encode(),
        b"\xef\xbb\xbf" + XML.format("UTF-8").encode(),
        XML.format("UTF-16").encode("utf-16"),
        b"\xfe\xff" + XML.format("UTF-16").encode("utf-16-be"),
        b'<!DOCTYPE score-partwise PUBLIC "-//Recordare//DTD MusicXML 3.1 Partwise//EN">',
    ],
    "a compressed MusicXML file": [
        _zip("META-INF/container.xml", "score.xml"),
        _zip("META-INF/container.xml", "song.musicxml", method=zipfile.ZIP_STORED),
    ],
    "a MuseScore file": [_zip("META-INF/container.xml", "song.mscx"), b'<?xml version="1.0"?><museScore version="4">'],
    "a zip archive": [_zip("a.wav", "b.wav"), _zip()],
    "a PDF file": [b"%PDF-1.7\n"],
    "a PNG picture": [b"\x89PNG\r\n\x1a\n"],
    "a JPEG picture": [b"\xff\xd8\xff\xe0\0\x10JFIF"],
    "an HTML page": [b"<!DOCTYPE html>\n<html>", b"\n<HTML><head>"],
    "an XML file": [b'<?xml version="1.0"?><plist>'],
    "a JSON file": [b'{"version": "0.5.4", "architecture": "WaveNet"}'],
    "a Scala scale": [b"! meantone.scl\n!\n1/4-comma meantone\n 12\n"],
}  # fmt: skip
UNKNOWN = [
    b"", b"\0", b"\xff", b"\xff\xff\xff\xff", b"not midi", bytes(200), b'name = "x"\n[neck]\n', b"PK", b"RIF",
    "Bünde".encode(), "name = 1".encode("utf-16"), "# a".encode("utf-16"), b"< 3",
    b"- a\n- b 2\n- c\n", b"-1\n-2\n-3\n", b"| a | b |\n|---|---|\n| 1 | 2 |\n", b"---\n---\n---\n---\n",
    b"\xff\xe8\x00\x00",
]  # fmt: skip


@pytest.mark.parametrize(("kind", "number"), [(kind, k) for kind, files in KINDS.items() for k in range(len(files))])
def test_the_first_bytes_tell_the_kind(kind: str, number: int) -> None:
    assert kind_of(KINDS[kind][number][:HEAD]) == kind


@pytest.mark.parametrize("data", UNKNOWN)
def test_other_bytes_are_of_no_kind(data: bytes) -> None:
    assert kind_of(data) is None


@pytest.mark.parametrize(
    "data",
    [
        b"a\n" + b" " * 1_000_000 + b"x",
        b"a\n" + b" " * 60_000 + b"x",
        b"------------\n" * 80_000,
        b"a\n" + b"-\n" * 30_000 + b"---\n" * 10_000,
        (b"PK\3\4" + bytes(22) + b"\xff\xff" + bytes(4)) * 30_000,
        b"<!--" + b"<score-" * 150_000,
    ],
    ids=["spaces", "fewer spaces", "dashes", "short lines", "zip", "XML"],
)  # fmt: skip
def test_no_bytes_take_long(data: bytes) -> None:
    began = time.process_time()
    assert kind_of(data) in (None, "a zip archive")
    assert time.process_time() - began < 10


def test_the_score_of_an_archive_may_stand_behind_much_else() -> None:
    names = [f"Content/Stylesheets/{k}" for k in range(900)]
    data = _zip(*names, "Content/score.gpif")
    assert len(data) > HEAD and kind_of(data) == "a Guitar Pro 7 file"


def test_only_one_list_has_the_endings_of_scores() -> None:
    """The page's file dialog and the plugin's window take theirs from it."""
    assert WORDS["endings"] == {"midi": MIDI_ENDINGS, "tab": TAB_ENDINGS}
    assert {".mid", ".sty", ".sst"} <= set(MIDI_ENDINGS) and {".gp5", ".musicxml", ".xml"} <= set(TAB_ENDINGS)
    own = re.compile("|".join(rf'[",]{re.escape(ending)}[",]' for ending in (*MIDI_ENDINGS, *TAB_ENDINGS)))
    folder = Path(livebass.__file__).parent
    sources = [path for name in ("web/static", "plugin/c") for path in (folder / name).rglob("*.*")]
    assert len(sources) > 50
    assert not [
        path.name for path in sources if path.suffix in (".js", ".html", ".c", ".h") and own.search(path.read_text())
    ]
