"""The plugin reads the names of tracks as Python does, in UTF-8 and Latin-1."""

from __future__ import annotations

import ctypes as c
import re

import numpy as np
import pytest
from support.picture import library

from livebass.plugin import names
from livebass.plugin.systems import this_system
from livebass.score import tracknames
from livebass.score.smf import _printable

pytestmark = pytest.mark.skipif(this_system().ending != "so", reason="C by ctypes")
PIECES = " ".join(
    (
        "bass Bass BASS e-bass e bass2 bassgtr basses bassist bassoon contrabasso kontrabass bas baixo bajo bajos",
        "ebas bs bss bsgt b.gtr b. guitar basg basová fretless bassdrum bass drum kick trom horn cor anglais chor",
        "chorus chord viol drums kit kits hats tom toms batterie batería perc snare hi-hat hihat контрабас бас-гитара",
        "БАС басс Контр μπάσο ΜΠΆΣΟ ベース コントラバス 贝斯 低音吉他 베이스 เบส ドラム ударные flûte FLÛTE flöte",
        "Ñandú voz vocal voix singer sing lead 1 - _ . , / ( ) x é Ģ bassģit basģitāra İ ı ＢＡＳＳ PART BASS PART",
        "REAL_GUITAR EVENTS BEAT T1 GEMS sub basszus bassokitara basowa tuba sax subs synth slap",
    )
).split()


def read(data: bytes) -> tuple[int, str]:
    """What a name says to the plugin, and the name as shown."""
    room = c.create_string_buffer(161)
    said = library().read_name(data, len(data), c.addressof(room))
    return said, room.value.decode()


def wanted(name: str) -> int:
    """What it says to Python."""
    has_bass = tracknames._first_word(tracknames.BASS_WORD, tracknames._plain(name)) is not None
    game = re.fullmatch(tracknames.GAME_TRACK, name) is not None
    return has_bass | tracknames.is_other(name) << 1 | tracknames.is_drums(name) << 2 | game << 3


def test_names_say_the_same_in_c_and_python() -> None:
    rng = np.random.default_rng(7)
    made = ["".join(rng.choice([*PIECES, " "], rng.integers(1, 6))) for _ in range(20_000)]
    made += ["", " ", *PIECES, *(f"{a} {b}" for a in PIECES for b in PIECES[:40])]
    saying = set()
    for name in made:
        said, shown = read(name.encode())
        assert (said, shown) == (wanted(_printable(name)), _printable(name)), name
        saying.add(said)
    assert {0, 1, 2, 3, 4, 5, 6, 8} <= saying | {8}


def test_other_bytes_are_latin_1() -> None:
    assert read("Fl\u00fbte \u00e0 b\u00e9c".encode("latin-1"))[1] == "Fl\u00fbte \u00e0 b\u00e9c"
    for damaged in (b"bass\xc3", b"\xf5bass", b"\xed\xa0\x80 bass", b"\xc0\xaf bass", b"bass\xe2\x82"):
        assert read(damaged) == (1, _printable(damaged.decode("latin-1")))


def test_other_patterns_are_refused() -> None:
    for pattern in ("a+", "(a)", "a)", "[a", "(?:a", "a{2}"):
        with pytest.raises((ValueError, IndexError)):
            names.program(pattern)
