"""Recognizes the kind of a file by its first bytes, for messages about a file of the wrong kind."""

from __future__ import annotations

import re

HEAD = 1 << 16  # bytes of a file, enough for `kind_of`

# Patterns of the first bytes -> kind of file; the first match counts
_SOUND_STARTS = (
    (rb"(?:RIFF|RIFX|RF64|BW64)....WAVE", "a WAV file"),
    (rb"FORM....AIF[FC]", "an AIFF file"),
    (rb"FORM....8SVX", "an 8SVX file"),
    (rb"RIFF....AVI ", "an AVI video"),
    (rb"fLaC", "a FLAC file"),
    (rb"caff", "a CAF file"),
    (rb"\.snd", "an AU file"),
    (rb"wvpk", "a WavPack file"),
    (rb"MAC ", "a Monkey's Audio file"),
    (rb"#!AMR", "an AMR file"),
    (rb"ID3", "an MP3 file"),
    (rb"\x30\x26\xb2\x75\x8e\x66\xcf\x11", "a Windows Media file"),
    (rb"OggS.{0,52}OpusHead", "an Opus file"),
    (rb"OggS.{0,54}vorbis", "an Ogg Vorbis file"),
    (rb"OggS", "an Ogg file"),
    (rb"....ftypM4[ABP]", "an M4A file"),
    (rb"....ftypqt", "a QuickTime video"),
    (rb"....ftyp", "an MP4 file"),
    (rb"\x1aE\xdf\xa3.{0,56}webm", "a WebM file"),
    (rb"\x1aE\xdf\xa3", "a Matroska file"),
)
_OTHER_STARTS = (
    (rb"MThd|RIFF....RMID|\0.{127}MThd", "a MIDI file"),  # the last behind 128 bytes of old Macintosh programs
    (rb"SMF2CLIP", "a MIDI 2.0 clip file"),
    (rb"BCF[SZ]", "a Guitar Pro 6 file"),
    *((rb".FI(?:CHIER|LE) GUITARE? PRO [vV]%d" % version, f"a Guitar Pro {version} file") for version in range(1, 6)),
    (rb"ptab", "a Power Tab file"),
    (rb".{0,4}T\0?u\0?x\0?G\0?u\0?i\0?t\0?a\0?r", "a TuxGuitar file"),
    (rb"\x0fSIBELIUS", "a Sibelius file"),
    (rb"FLhd", "an FL Studio project"),
    (rb"<REAPER_PROJECT", "a REAPER project"),
    (rb"RIFF....sfbk", "a SoundFont"),
    (rb"RIFF....WEBP", "a WebP picture"),
    (rb"RIFF|RIFX|RF64|BW64", "a RIFF file"),
    (rb"FORM", "an IFF file"),
    (rb"%PDF-", "a PDF file"),
    (rb"%!PS", "a PostScript file"),
    (rb"\x89PNG\r\n\x1a\n", "a PNG picture"),
    (rb"\xff\xd8\xff", "a JPEG picture"),
    (rb"GIF8", "a GIF picture"),
    (rb"\x1f\x8b", "a gzip archive"),
    (rb"BZh", "a bzip2 archive"),
    (rb"7z\xbc\xaf\x27\x1c", "a 7z archive"),
    (rb"Rar!\x1a\x07", "a RAR archive"),
    (rb"\xfd7zXZ\0", "an xz archive"),
    (rb"SQLite format 3\0", "an SQLite database"),
    (rb"\x7fELF", "a program"),
)
_STARTS = (*_SOUND_STARTS, *_OTHER_STARTS)
# Beginnings of texts, after white space
_TEXTS = (
    (r"(?=<).*?(?:<(?:score-partwise|score-timewise)\b|<!DOCTYPE\s+score-)", "a MusicXML file"),
    (r"(?=<).*?<museScore\b", "a MuseScore file"),
    (r"(?=<).*?<mei\b", "an MEI file"),
    (r"(?=<).*?<svg\b", "an SVG picture"),
    (r"(?i)(?=<).*?<(?:!doctype html|html\b)", "an HTML page"),
    (r"<\?xml", "an XML file"),
    (r'\{\s*("|\})', "a JSON file"),
    (r"\\version\s", "a LilyPond file"),
    (r"%abc\b|X:\s*\d+\s*\n", "an ABC file"),
    (r"!\s*\S[^\n]*\.scl\s*\n", "a Scala scale"),
)
# Names of files in a zip archive -> its kind; only so many names, and so many bytes of each, are read
_MAX_NAMES, _LONGEST_NAME = 1000, 260
_IN_ZIP = (
    (rb"Content/(?:score\.gpif|BinaryStylesheet.*|ScoreViews.*|PartConfiguration.*)", "a Guitar Pro 7 file"),
    (rb".*\.mscx", "a MuseScore file"),
    (rb".*\.(?:musicxml|mxl)|META-INF/container\.xml", "a compressed MusicXML file"),
    (rb"word/.*", "a Word document"),
    (rb"xl/.*", "an Excel document"),
)
TEXT_TAB = "a text tab"
_DASH = r"[\-\u2010-\u2015\u2212\u2500]"
_STRING_NAME = r"(?:[A-Ha-h][#b]?\d?|[#b]\d?|\d)"
_STRING = re.compile(rf"[>\s]*(?:{_STRING_NAME}\s*)?(?:[|:\[\]]|{_DASH}).*")  # a line of a text tab
_MIN_STRINGS = 3  # lines one below the other
_MIN_DASHES, _MIN_PART = 2, 0.4  # in each line; of its characters, with bar lines
# Extensions of scores, for files whose bytes tell nothing
_ENDINGS = {
    **{f".gp{version}": f"a Guitar Pro {version} file" for version in (1, 2, 3, 4, 5)},
    ".gtp": "a Guitar Pro 2 file", ".gpx": "a Guitar Pro 6 file", ".gp": "a Guitar Pro 7 file",
    ".ptb": "a Power Tab file", ".tg": "a TuxGuitar file", ".mscz": "a MuseScore file", ".mscx": "a MuseScore file",
    ".musicxml": "a MusicXML file", ".mxl": "a compressed MusicXML file",
}  # fmt: skip
# Kinds that may hold sound, kinds that hold notes, and kinds to unpack
SOUNDS = {kind for _, kind in _SOUND_STARTS} | {"a RIFF file", "an IFF file", "an AAC file", "an MPEG audio file"}
SCORES = {
    "a MIDI file", "a MIDI 2.0 clip file", "an MEI file", "a LilyPond file", "an ABC file", "a Sibelius file",
    "an FL Studio project", "a REAPER project", *_ENDINGS.values(),
}  # fmt: skip
TABLATURES = {
    *(f"a Guitar Pro {version} file" for version in range(3, 8)), "a MusicXML file", "a compressed MusicXML file",
}  # fmt: skip
# Extensions for file dialogs: of MIDI files, with karaoke and Yamaha's styles, and of tablatures
MIDI_ENDINGS = (".mid", ".midi", ".smf", ".kar", ".rmi", ".sty", ".sst", ".prs")
TAB_ENDINGS = (*(ending for ending, kind in _ENDINGS.items() if kind in TABLATURES), ".xml")
ARCHIVES = {"a zip archive"} | {kind for _, kind in _OTHER_STARTS if kind.endswith(" archive")}


def kind_of(data: bytes) -> str | None:
    """The kind of a file that begins with `data`, as an English noun phrase: "a MIDI file", "a PDF file" ...

    None for unknown bytes, such as most text. HEAD bytes are enough; fewer may tell less.
    """
    found = next((kind for start, kind in _STARTS if re.match(start, data, re.DOTALL)), None) or _zip(data)
    if found is None:
        wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
        text = data[:HEAD].decode("utf-16" if wide else "utf-8-sig", "ignore").lstrip()
        found = next((kind for start, kind in _TEXTS if re.match(start, text, re.DOTALL)), None)
        found = found or (TEXT_TAB if _is_text_tab(text) else None)
    return found or _mpeg(data)


def is_tab(data: bytes) -> bool:
    """True for the bytes of a tablature."""
    return kind_of(data) in TABLATURES


def kind_of_name(name: str) -> str | None:
    """The kind of a file by its name, if its program can export it as MIDI; None for any other."""
    return next((kind for ending, kind in _ENDINGS.items() if name.lower().endswith(ending)), None)


def _is_text_tab(text: str) -> bool:
    """True if lines of dashes stand one below the other, with frets on some of them."""
    strings, fretted = 0, False
    for line in text.splitlines():
        dashes, bars = len(re.findall(_DASH, line)), line.count("|")
        is_string = _STRING.fullmatch(line) and dashes >= _MIN_DASHES and dashes + bars >= _MIN_PART * len(line)
        strings = strings + 1 if is_string else 0
        fretted = bool(strings) and (fretted or any(c.isdigit() for c in line))
        if strings >= _MIN_STRINGS and fretted:
            return True
    return False


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


def _zip(data: bytes) -> str | None:
    """A zip archive, by the file names that stand in `data`."""
    if not data.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        return None
    names: list[bytes] = []
    at = 0
    while (at := data.find(b"PK\x03\x04", at)) >= 0 and len(names) < _MAX_NAMES:
        length = min(int.from_bytes(data[at + 26 : at + 28], "little"), _LONGEST_NAME)
        names.append(data[at + 30 : at + 30 + length])
        at += 4
    found = (kind for form, kind in _IN_ZIP if any(re.fullmatch(form, name, re.DOTALL) for name in names))
    return next(found, "a zip archive")
