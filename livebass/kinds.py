"""Recognizes the kind of a file by its first bytes, for messages about a file of the wrong kind."""

from __future__ import annotations

import re
from collections.abc import Callable

HEAD = 1 << 16  # bytes of a file, enough for `kind_of`

# The first bytes of a file -> its kind; the first match counts
_STARTS: tuple[tuple[bytes, str], ...] = (
    (b"MThd", "a MIDI file"),
    (b"fLaC", "a FLAC file"),
    (b"caff", "a CAF file"),
    (b".snd", "an AU file"),
    (b"wvpk", "a WavPack file"),
    (b"MAC ", "a Monkey's Audio file"),
    (b"#!AMR", "an AMR file"),
    (b"ID3", "an MP3 file"),
    (bytes.fromhex("3026b2758e66cf11"), "a Windows Media file"),
    (b"BCFS", "a Guitar Pro 6 file"),
    (b"BCFZ", "a Guitar Pro 6 file"),
    (b"ptab", "a Power Tab file"),
    (b"%PDF-", "a PDF file"),
    (b"%!PS", "a PostScript file"),
    (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"GIF8", "a GIF picture"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"BZh", "a bzip2 archive"),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive"),
    (b"Rar!\x1a\x07", "a RAR archive"),
    (b"\xfd7zXZ\x00", "an xz archive"),
    (b"SQLite format 3\x00", "an SQLite database"),
    (b"\x7fELF", "a program"),
)
# Form of a RIFF or an IFF file, its bytes 8 to 11
_FORMS = {
    b"WAVE": "a WAV file",
    b"RMID": "a MIDI file",
    b"sfbk": "a SoundFont",
    b"AVI ": "an AVI video",
    b"WEBP": "a WebP picture",
    b"AIFF": "an AIFF file",
    b"AIFC": "an AIFF file",
    b"8SVX": "an 8SVX file",
}
# Names of files in a zip archive -> its kind
_IN_ZIP: tuple[tuple[re.Pattern[bytes], str], ...] = (
    (
        re.compile(rb"Content/score\.gpif|Content/(BinaryStylesheet|ScoreViews|PartConfiguration)"),
        "a Guitar Pro 7 file",
    ),
    (re.compile(rb".*\.mscx"), "a MuseScore file"),
    (re.compile(rb".*\.(musicxml|mxl)"), "a compressed MusicXML file"),
    (re.compile(rb"word/.*"), "a Word document"),
    (re.compile(rb"xl/.*"), "an Excel document"),
)
# Kinds that may hold sound, and kinds that hold notes
SOUNDS = frozenset(
    f"{kind} file" for kind in (
        "a FLAC", "a CAF", "an AU", "a WavPack", "a Monkey's Audio", "an AMR", "an MP3", "a Windows Media", "a WAV",
        "a RIFF", "an AIFF", "an IFF", "an 8SVX", "an Ogg Vorbis", "an Opus", "an Ogg", "an M4A", "an MP4", "a WebM",
        "a Matroska", "an AAC", "an MPEG audio",
    )
) | {"an AVI video", "a QuickTime video"}  # fmt: skip
SCORES = frozenset(
    f"{kind} file" for kind in (
        "a MIDI", *(f"a Guitar Pro {version}" for version in range(1, 8)), "a Power Tab", "a TuxGuitar", "a MuseScore",
        "a MusicXML", "a compressed MusicXML", "an MEI", "a LilyPond", "an ABC",
    )
)  # fmt: skip
ARCHIVES = frozenset(f"{kind} archive" for kind in ("a zip", "a gzip", "a bzip2", "a 7z", "a RAR", "an xz"))
# Extensions, for files whose bytes tell nothing
_ENDINGS = {
    **{f".gp{version}": f"a Guitar Pro {version} file" for version in (1, 2, 3, 4, 5)},
    ".gtp": "a Guitar Pro 2 file", ".gpx": "a Guitar Pro 6 file", ".gp": "a Guitar Pro 7 file",
    ".ptb": "a Power Tab file", ".tg": "a TuxGuitar file", ".mscz": "a MuseScore file", ".mscx": "a MuseScore file",
    ".musicxml": "a MusicXML file", ".mxl": "a compressed MusicXML file",
}  # fmt: skip
_AUDIO_BRANDS = (b"M4A", b"M4B", b"M4P")
_XML: tuple[tuple[re.Pattern[str], str], ...] = (
    (re.compile(r"<(score-partwise|score-timewise)\b|<!DOCTYPE\s+score-"), "a MusicXML file"),
    (re.compile(r"<museScore\b"), "a MuseScore file"),
    (re.compile(r"<mei\b"), "an MEI file"),
    (re.compile(r"<svg\b"), "an SVG picture"),
    (re.compile(r"<!doctype html|<html\b", re.IGNORECASE), "an HTML page"),
)


def kind_of(data: bytes) -> str | None:
    """The kind of a file that begins with `data`, as an English noun phrase: "a MIDI file", "a PDF file" ...

    None for unknown bytes, such as most text. HEAD bytes are enough; fewer may tell less.
    """
    for start, kind in _STARTS:
        if data.startswith(start):
            return kind
    for told in _TOLD:
        if found := told(data):
            return found
    return None


def kind_of_name(name: str) -> str | None:
    """The kind of a file by its name, if its program can export it as MIDI; None for any other."""
    return next((kind for ending, kind in _ENDINGS.items() if name.lower().endswith(ending)), None)


def _of_form(data: bytes) -> str | None:
    """RIFF and IFF files, and others with their form at bytes 8 to 11."""
    if data[:4] in (b"RIFF", b"RIFX", b"RF64", b"BW64", b"FORM"):
        return _FORMS.get(data[8:12], "a RIFF file" if data[:4] != b"FORM" else "an IFF file")
    return None


def _ogg(data: bytes) -> str | None:
    if not data.startswith(b"OggS"):
        return None
    if b"OpusHead" in data[:64]:
        return "an Opus file"
    return "an Ogg Vorbis file" if b"vorbis" in data[:64] else "an Ogg file"


def _mp4(data: bytes) -> str | None:
    """The container of MPEG-4 and QuickTime, whose first part is `ftyp`."""
    if data[4:8] != b"ftyp":
        return None
    if data[8:11] in _AUDIO_BRANDS:
        return "an M4A file"
    return "a QuickTime video" if data[8:10] == b"qt" else "an MP4 file"


def _matroska(data: bytes) -> str | None:
    if not data.startswith(b"\x1aE\xdf\xa3"):
        return None
    return "a WebM file" if b"webm" in data[:64] else "a Matroska file"


def _mpeg(data: bytes) -> str | None:
    """MP3 and AAC that begin with a frame: 11 bits set, then a valid version, layer and rates.

    Excludes Layer I: nobody uses it, and it begins like a UTF-16 text.
    """
    if len(data) < 4 or data[0] != 0xFF:
        return None
    if data[1] & 0xF6 == 0xF0:  # 12 bits set, layer 0: ADTS
        return "an AAC file" if data[2] >> 2 & 0xF < 13 else None
    layer, version = data[1] >> 1 & 3, data[1] >> 3 & 3
    frame = (
        data[1] & 0xE0 == 0xE0 and version != 1 and layer in (1, 2) and data[2] >> 4 != 0xF and data[2] >> 2 & 3 != 3
    )
    return ("an MP3 file" if layer == 1 else "an MPEG audio file") if frame else None


def _guitar_pro(data: bytes) -> str | None:
    """Guitar Pro 1 to 5: a text after its length, ending in a version."""
    found = re.match(rb".FI(?:CHIER|LE) GUITAR(?:E)? PRO [vV](\d)", data, re.DOTALL)
    return f"a Guitar Pro {int(found[1])} file" if found else None


def _tuxguitar(data: bytes) -> str | None:
    return "a TuxGuitar file" if b"TuxGuitar" in data[:64].replace(b"\x00", b"") else None


def _zip(data: bytes) -> str | None:
    """A zip archive, by the file names that stand in `data`."""
    if not data.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        return None
    names = []
    at = 0
    while (at := data.find(b"PK\x03\x04", at)) >= 0:
        length = int.from_bytes(data[at + 26 : at + 28], "little")
        names.append(data[at + 30 : at + 30 + length])
        at += 4
    for form, kind in _IN_ZIP:
        if any(form.fullmatch(name) for name in names):
            return kind
    return "a compressed MusicXML file" if b"META-INF/container.xml" in names else "a zip archive"


def _macbinary(data: bytes) -> str | None:
    """A MIDI file behind the 128-byte header that old Macintosh programs wrote."""
    return "a MIDI file" if data[128:132] == b"MThd" and data[:1] == b"\x00" else None


def _text(data: bytes) -> str | None:
    """Kinds of text, in UTF-8 or UTF-16."""
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    text = data.decode("utf-16" if wide else "utf-8-sig", "ignore").lstrip()
    if text.startswith("<"):
        for form, kind in _XML:
            if form.search(text):
                return kind
        return "an XML file" if text.startswith("<?xml") else None
    if re.match(r'\{\s*("|\})', text):
        return "a JSON file"
    if re.match(r"\\version\s", text):
        return "a LilyPond file"
    if re.match(r"%abc\b|X:\s*\d+\s*\n", text):
        return "an ABC file"
    return "a Scala scale" if re.match(r"!\s*\S[^\n]*\.scl\s*\n", text) else None


_TOLD: tuple[Callable[[bytes], str | None], ...] = (
    _of_form, _ogg, _mp4, _matroska, _guitar_pro, _tuxguitar, _zip, _macbinary, _text, _mpeg,
)  # fmt: skip
