"""MIDI files as found in practice, one kind after the other: each is made here, and read as its owner expects."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest
from support.smf import BASS, END, chunk, events, named, note_of, read, smf, struck, variable

from livebass.score import tracknames
from livebass.score.reading import ScoreError, read_parts, read_score

RATE = 48000
LINE = (28, 33, 35, 40)  # E1 A1 B1 E2
Rows = list[tuple[int, tuple[int, ...]]]


def line(channel: int, keys: tuple[int, ...] = LINE, program: int | None = None, start: int = 0) -> Rows:
    """Notes of 200 ticks, one every 240."""
    rows: Rows = [] if program is None else [(start, (0xC0 | channel, program))]
    for k, key in enumerate(keys):
        rows += note_of(channel, key, start + 240 * k, start + 240 * k + 200)
    return rows


def meta(kind: int, data: bytes) -> tuple[int, ...]:
    return (0xFF, kind, len(data), *data)


def exclusive(data: bytes) -> tuple[int, ...]:
    return (0xF0, len(data) + 1, *data, 0xF7)


PIANO = events((0, meta(3, b"Piano")), *line(0, (60, 64, 67, 72), 0))
BASS_TRACK = events((0, meta(3, b"Line")), *line(1, LINE, 33))


# ---- a clip, and parts without programs


@pytest.mark.parametrize("kind", [0, 1])
@pytest.mark.parametrize("channel", [0, 4, 15])
def test_the_only_part_is_played(tmp_path: Path, kind: int, channel: int) -> None:
    score = read(tmp_path, smf(events((0, meta(3, b"Take 3")), *line(channel)), kind=kind))
    assert struck(score) == list(LINE) and score.program is None
    assert f'plays the only part, channel {channel + 1} "Take 3"' in score.remarks[0]


def test_drums_beside_the_only_part_are_none(tmp_path: Path) -> None:
    """Recognized by channel or by name."""
    for drums in (line(9, (36, 38)), [(0, meta(3, b"Drum Loop")), *line(0, (36, 38, 42))]):
        assert struck(read(tmp_path, smf(events(*line(0)), events(*drums)))) == list(LINE)


def test_of_several_parts_without_programs_the_one_in_a_basss_range_is_played(tmp_path: Path) -> None:
    """On a shared channel too, with only its own track's volume."""
    lead, keys = (0, 64, 67, 71), (48, 55, 60, 64)
    for channels in ((0, 1, 2), (0, 0, 0)):
        tracks = [
            events((0, (0xB0 | channel, 7, volume)), *line(channel, notes))
            for channel, notes, volume in zip(channels, (lead[1:], LINE, keys), (10, 90, 20), strict=True)
        ]
        score = read(tmp_path, smf(*tracks))
        assert struck(score) == list(LINE) and "in a bass's range" in score.remarks[0]
        assert [m[2] for m in score.messages.tolist() if m[0] & 0xF0 == 0xB0] == [90]


def test_parts_with_programs_that_are_no_bass_are_not_guessed_at(tmp_path: Path) -> None:
    data = smf(events(*line(0, (40, 43), 0)), events(*line(1, (60, 64), 48)))
    with pytest.raises(ScoreError, match="no bass notes"):
        read(tmp_path, data)
    assert struck(read(tmp_path, data, "all")) == [40, 60, 43, 64]


# ---- ports, shared channels, kits


def test_programs_and_controllers_count_by_port(tmp_path: Path) -> None:
    for place in (0, 3):  # of the port in the track: it applies to the whole track
        one, two = line(1, program=33), line(1, (72, 74), program=56)
        one.insert(place and 1, (0, meta(0x21, b"\x00")))
        two.insert(place and 1, (0, meta(0x21, b"\x01")))
        two.append((900, (0xB1, 7, 0)))
        score = read(tmp_path, smf(events(*one), events(*two)))
        assert struck(score) == list(LINE) and score.program == 33
        assert all(m[0] & 0xF0 != 0xB0 for m in score.messages.tolist())
    ports = [(p.port, p.programs, p.chosen) for p in read_parts(tmp_path / "song.mid")]
    assert ports == [(1, (34,), 4), (2, (57,), 0)]


def test_two_basses_on_one_channel_of_two_ports_get_channels_of_their_own(tmp_path: Path) -> None:
    tracks = [events((0, meta(0x21, bytes([port]))), *line(3, keys, 33)) for port, keys in ((0, LINE), (5, (43, 45)))]
    score = read(tmp_path, smf(*tracks))
    channels: dict[int, set[int]] = {}
    for status, key, _ in score.messages.tolist():
        if status & 0xF0 == 0x90:
            channels.setdefault(status & 0x0F, set()).add(key)
    assert sorted(map(sorted, channels.values())) == [sorted(LINE), [43, 45]] and 3 in channels


def test_tracks_that_share_a_channel_have_their_own_programs(tmp_path: Path) -> None:
    """One more program sets nothing; the conductor's volume applies to all, the organ's does not."""
    tracks = (
        events((0, (0xB0, 7, 77))),
        events((0, (0xB0, 10, 20)), *line(0, (60, 64), 16)),
        events(*line(0, LINE, 33)),
    )
    for order in ((0, 1, 2), (2, 0, 1)):
        score = read(tmp_path, smf(*(tracks[k] for k in order)))
        assert struck(score) == list(LINE) and score.program == 33
        assert [m[1:] for m in score.messages.tolist() if m[0] & 0xF0 == 0xB0] == [[7, 77]]
    parts = read_parts(tmp_path / "song.mid")
    assert sorted((p.programs, p.chosen) for p in parts) == [((17,), 0), ((34,), 4)]


KITS: dict[str, tuple[Rows, int]] = {
    # name: (the message that makes the kit's channel one, that channel)
    "channel 10": ([], 9),
    "bank of General MIDI 2": ([(0, (0xBA, 0, 120)), (0, (0xBA, 32, 0))], 10),
    "bank of XG": ([(0, exclusive(b"\x43\x10\x4c\x00\x00\x7e\x00")), (0, (0xBA, 0, 127))], 10),
    "bank of XG, effects": ([(0, exclusive(b"\x43\x10\x4c\x00\x00\x7e\x00")), (0, (0xBA, 0, 126))], 10),
    "part mode of XG": ([(0, exclusive(b"\x43\x10\x4c\x08\x0c\x07\x02"))], 12),
    "rhythm part of GS, channel 11": ([(0, exclusive(b"\x41\x10\x42\x12\x40\x1a\x15\x02\x0f"))], 10),
    "rhythm part of GS, channel 3": ([(0, exclusive(b"\x41\x10\x42\x12\x40\x13\x15\x01\x17"))], 2),
}


@pytest.mark.parametrize("name", KITS)
def test_kits_are_not_played(tmp_path: Path, name: str) -> None:
    setting, channel = KITS[name]
    data = smf(events(*setting, *line(channel, (36, 38), 33)), events(*line(1, program=33)))
    assert struck(read(tmp_path, data)) == list(LINE)
    assert [p.is_drums for p in read_parts(tmp_path / "song.mid")].count(True) == 1


MELODIC: dict[str, Rows] = {
    "bank of General MIDI 2": [(0, (0xB9, 0, 121))],
    "bank of XG": [(0, exclusive(b"\x43\x10\x4c\x00\x00\x7e\x00")), (0, (0xB9, 0, 0))],
    "part of GS": [(0, exclusive(b"\x41\x10\x42\x12\x40\x10\x15\x00\x1b"))],
}


@pytest.mark.parametrize("name", MELODIC)
def test_channel_10_may_be_melodic(tmp_path: Path, name: str) -> None:
    assert struck(read(tmp_path, smf(events(*MELODIC[name], *line(9, program=33))))) == list(LINE)


@pytest.mark.parametrize("kind", [3, 4])
@pytest.mark.parametrize("program", [None, 33, 0])
def test_a_track_called_bass_on_channel_10_is_a_bass(tmp_path: Path, program: int | None, kind: int) -> None:
    """Some programs number channels by track. A bass drum has fewer keys; a kit by its bank is a kit."""
    strings = events((0, meta(3, b"Strings")), *line(0, (60, 62)))
    bass = [(0, meta(kind, b"E-Bass")), *line(9, program=program)]
    assert struck(read(tmp_path, smf(strings, events(*bass)))) == list(LINE)
    for drums in (
        [(0, meta(kind, b"Bass")), *line(9, (35, 36, 35, 36), program)],
        [(0, meta(kind, b"Drums")), *line(9, program=program)],
        [(0, (0xB9, 0, 127)), *bass],
    ):
        assert struck(read(tmp_path, smf(strings, events(*drums)))) == [60, 62]


def test_a_bank_127_of_gs_is_no_kit_and_a_reset_makes_kits_as_they_were(tmp_path: Path) -> None:
    reset = exclusive(b"\x41\x10\x42\x12\x40\x00\x7f\x00\x41")
    kit = exclusive(b"\x41\x10\x42\x12\x40\x11\x15\x01\x19")
    rows = [(0, kit), (0, reset), (1, (0xB0, 0, 127)), *line(0, program=33, start=2)]
    assert struck(read(tmp_path, smf(events(*rows)))) == list(LINE)


def test_a_program_after_the_first_note_is_its_program(tmp_path: Path) -> None:
    rows = sorted([*line(2), (260, (0xC2, 34))], key=lambda row: row[0])
    score = read(tmp_path, smf(events(*line(0, (60, 64, 67, 72), 0)), events(*rows)))
    assert struck(score) == list(LINE) and (score.program, score.changes) == (34, [])


# ---- harmless damage


def damage(data: bytes, at: int, new: bytes) -> bytes:
    return data[:at] + new + data[at + len(new) :]


GOOD = smf(PIANO, BASS_TRACK)
SECOND = GOOD.index(b"MTrk", 20)  # the bass's chunk
FIRST_LENGTH = 18
HIGH = (0, (0xB1, 7, 0xFF))  # a data byte above 0x7F

DAMAGE = {
    # name: (bytes, the only warning's text)
    "header promises fewer": (damage(GOOD, 10, b"\x00\x01"), "has 2 tracks, not 1"),
    "header promises none": (damage(GOOD, 10, b"\x00\x00"), "has 2 tracks, not 0"),
    "track claims 5 bytes more": (damage(GOOD, FIRST_LENGTH, (len(PIANO) + 5).to_bytes(4)), "5 bytes shorter"),
    "track claims all bytes": (damage(GOOD, FIRST_LENGTH, b"\x7f\xff\xff\xff"), "bytes shorter"),
    "track claims the next one": (
        damage(GOOD, FIRST_LENGTH, (len(GOOD) - FIRST_LENGTH - 4).to_bytes(4)), "bytes shorter",
    ),
    "track claims 9 bytes less": (damage(GOOD, FIRST_LENGTH, (len(PIANO) - 9).to_bytes(4)), "9 bytes longer"),
    "track claims nothing": (damage(GOOD, FIRST_LENGTH, bytes(4)), "bytes longer"),
    "track without an end claims too much": (
        damage(smf(PIANO[:-4], BASS_TRACK), FIRST_LENGTH, (len(PIANO)).to_bytes(4)), "4 bytes shorter",
    ),
    "stray bytes between tracks": (GOOD[:SECOND] + bytes(7) + GOOD[SECOND:], "stray bytes"),
    "a line's end between tracks": (GOOD[:SECOND] + b"\r\n" + GOOD[SECOND:], "stray bytes"),
    "stray bytes before the tracks": (GOOD[:14] + b"\xff\x00" + GOOD[14:], "stray bytes"),
    "MacBinary": (b"\x00\x08song.mid".ljust(128, b"\x00") + GOOD + bytes(40), "skipped 128 bytes before the header"),
    "active sensing": (
        smf(PIANO, events((0, (0xFE,)), (0, (0xF8,)), *line(1, program=33))), "skipped 2 system messages",
    ),
    "song position": (smf(PIANO, events((0, (0xF2, 1, 2)), *line(1, program=33))), "skipped 1 system message "),
    "data above 0x7F": (smf(PIANO, events(HIGH, *line(1, program=33))), "1 data byte above 0x7F for 0x7F (track 2"),
    "the same in another part": (
        smf(events((0, (0xB0, 0xC8, 3)), (9, (0xE0, 0, 0x80)), *line(0, (60, 64), 0, 9)), BASS_TRACK),
        "took 2 data bytes above 0x7F for 0x7F (first at track 1",
    ),
    "tempo 0": (smf(events((0, meta(0x51, bytes(3)))), BASS_TRACK), "ignored 1 tempo"),
    "tempo of 4 bytes": (smf(events((0, meta(0x51, b"\x00\x07\xa1\x20"))), BASS_TRACK), "ignored 1 tempo"),
    "tempo of 2 bytes": (smf(events((0, meta(0x51, b"\xa1\x20"))), BASS_TRACK), "ignored 1 tempo"),
    "patterns": (smf(BASS_TRACK, BASS_TRACK, kind=2), "plays number 1"),
}  # fmt: skip


@pytest.mark.parametrize("name", DAMAGE)
def test_damage_that_does_not_matter_is_read_with_one_warning(tmp_path: Path, name: str) -> None:
    data, says = DAMAGE[name]
    score = read(tmp_path, data)
    assert struck(score) == list(LINE) and score.program == 33
    (warning,) = score.remarks
    assert says in warning, warning
    if name == "data above 0x7F":
        assert [0xB1, 7, 127] in score.messages.tolist()


def test_files_by_the_book_are_read_without_a_word(tmp_path: Path) -> None:
    riff = b"RIFF" + (len(GOOD) + 12).to_bytes(4, "little") + b"RMID" + b"data" + len(GOOD).to_bytes(4, "little") + GOOD
    info = b"RIFF" + bytes(4) + b"RMID" + b"DISP" + (3).to_bytes(4, "little") + b"abc\x00" + riff[12:]
    for data in (
        GOOD,
        smf(PIANO, BASS_TRACK[:-4]),
        riff,
        info,
        smf(BASS_TRACK, kind=2),
        GOOD + chunk(b"XFKM", b"text"),
    ):
        score = read(tmp_path, data)
        assert struck(score) == list(LINE) and score.remarks == ()


def test_a_second_file_behind_the_first_is_another_file(tmp_path: Path) -> None:
    assert struck(read(tmp_path, GOOD + GOOD)) == list(LINE)


@pytest.mark.parametrize("rest", [20 * 60, 20 * 3600, 70 * 3600])
def test_a_file_ends_with_its_last_note(tmp_path: Path, rest: int) -> None:
    """A note without an end rings on for some seconds there."""
    track = events(*line(1, program=33))[: -len(END)]
    far = variable(rest * 960) + END[1:]
    score = read(tmp_path, smf(track + far))
    assert score.file_end == score.end_frame == (3 * 240 + 200) * 50
    hanging = read(tmp_path, smf(BASS + b"\x00\x90\x28\x64" + far))
    assert 5 * RATE < hanging.end_frame < 60 * RATE
    near = read(tmp_path, smf(track + variable(30 * 960) + END[1:]))
    assert near.file_end == near.end_frame + 30 * RATE


# ---- controllers with another meaning


def test_portamento_time_bends_nothing(tmp_path: Path) -> None:
    score = read(tmp_path, smf(events((0, (0xB1, 5, 0)), (1, (0xB1, 5, 64)), *line(1, program=33, start=2))))
    assert struck(score) == list(LINE) and all(m[1] != 5 for m in score.messages.tolist())
    assert "controller 5" in score.remarks[0]
    assert read(tmp_path, smf(events((0, (0xB1, 5, 64)), *line(1, program=33)))).remarks == (), "it would bend nothing"
    take = events((0, meta(1, b"as played by livebass")), (0, (0xB0, 5, 0)), (9, (0xB0, 5, 64)), *line(0, start=9))
    assert [m[1:] for m in read(tmp_path, smf(take)).messages.tolist() if m[0] == 0xB0] == [[5, 0], [5, 64]]


TUNINGS = {
    b"\x7f\x7f\x04\x03\x00\x50": "+25 cents (system exclusive); --a4 446.4",
    b"\x7f\x7f\x04\x04\x00\x3f": "-100 cents",
    b"\x41\x10\x42\x12\x40\x00\x00\x00\x04\x00\x0a\x32": "+1 cents",
    b"\x43\x10\x4c\x00\x00\x00\x00\x03\x0f\x06": "-1 cents",
    b"\x7f\x7f\x08\x02\x00\x01\x28\x28\x00\x00": "single notes",
}


@pytest.mark.parametrize("data", TUNINGS)
def test_tunings_by_system_exclusive_are_told(tmp_path: Path, data: bytes) -> None:
    score = read(tmp_path, smf(events((0, exclusive(data)), *line(1, program=33))))
    (remark,) = score.remarks
    assert TUNINGS[data] in remark and struck(score) == list(LINE)


# ---- keys


@pytest.mark.parametrize("order", [0, 1])
def test_a_key_that_ends_on_another_channel_ends(tmp_path: Path, order: int) -> None:
    ends = [(240, (0x82, 40, 0)), (480, (0x81, 43, 0))][:: 1 - 2 * order]
    rows = [(0, (0xC1, 33)), (0, (0xC2, 33)), (0, (0x91, 40, 90)), (0, (0x92, 43, 90)), *ends]
    score = read(tmp_path, smf(events(*sorted(rows, key=lambda row: row[0]))))
    ended = {
        m[1]: (f, m[0] & 15) for f, m in zip(score.frames.tolist(), score.messages.tolist(), strict=True) if m[0] < 0x90
    }
    assert ended == {40: (12000, 1), 43: (24000, 2)}


def test_a_take_keeps_its_note_offs_on_channels_without_notes(tmp_path: Path) -> None:
    rows = [(0, meta(1, b"as played by livebass")), (0, (0x90, 40, 90)), (240, (0x83, 40, 10)), (960, (0x80, 40, 64))]
    assert [m[0] for m in read(tmp_path, smf(events(*rows))).messages.tolist()] == [0x90, 0x83, 0x80]


# ---- names

NAMES = (
    "Basse", "Baixo", "Bajo", "Basso", "Bas", "Contrabass", "Kontrabass", "Contrebasse", "Contrabajo", "BassGtr",
    "JazzBass", "SlapBass", "Fretless", "FINGERED BS", "ベース", "エレキベース", "贝斯", "貝斯", "低音吉他", "Бас",
    "Бас-гитара", "Контрабас", "베이스", "Gitara basowa", "Basgitaar", "Basszusgitár", "Syn.Bass 2", "5-str. E-Bass",
)  # fmt: skip
NO_NAMES = (
    "Bassoon", "Basson", "Clarinette basse", "Bass Trombone", "Bass Drum", "Bass Tuba", "Trabajo", "Database", "Abs",
    "Бассейн", "バスドラム", "Voix basse", "Basset Horn", "",
)  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_names_of_basses_in_the_languages_of_people(tmp_path: Path, name: str) -> None:
    score = read(tmp_path, smf(named(b"Keys", 0, 60, 64), named(name.encode(), 1, 72, 74)))
    assert struck(score) == [72, 74] and score.remarks[0].endswith(f'called "{name}"')


@pytest.mark.parametrize("name", NO_NAMES)
def test_names_of_other_instruments(name: str) -> None:
    assert not tracknames.is_bass(name)


@pytest.mark.parametrize(
    ("name", "encoding"),
    [("ベース", "cp932"), ("贝斯", "gbk"), ("貝斯", "big5"), ("Бас", "cp1251"), ("Бас", "koi8_r"), ("베이스", "euc_kr"),
     ("Basse électrique", "latin-1"), ("Basová kytara", "cp1250")],
)  # fmt: skip
def test_names_in_the_encodings_of_people(tmp_path: Path, name: str, encoding: str) -> None:
    score = read(tmp_path, smf(named(b"Keys", 0, 60), named(name.encode(encoding), 1, 72)))
    assert struck(score) == [72] and f'called "{name[:3]}' in score.remarks[0]


UNLIKE = {
    "Bass Trumpet": 56, "Bass Sackbut": 57, "Bass": 52, "Basso": 53, "Bas": 54, "Bass Shawm": 67,
    "Bass Sheng": 20, "Orff Bass Metallophone": 11, "Bas davul": 116, "Бас": 52,
}  # fmt: skip  # names that MuseScore 3.2.3 gives to voices, winds, mallets and drums, and their programs


@pytest.mark.parametrize("name", UNLIKE)
def test_a_voice_wind_or_drum_called_bass_is_none_beside_a_bass(tmp_path: Path, name: str) -> None:
    program = bytes([UNLIKE[name]])
    keys, other = named(b"Keys", 0, 60, 64, program=b"\0"), named(name.encode(), 1, 48, 50, program=program)
    for bass in ("Contrabass", "Kontrabässe", "Contrabaix", "Nagybőgő", "Контрабасы"):
        data = smf(keys, other, named(bass.encode(), 2, 28, 33, program=b"\x2b"))
        assert struck(read(tmp_path, data)) == [28, 33], bass
    assert struck(read(tmp_path, data, 2)) == [48, 50], "as asked for"
    assert struck(read(tmp_path, smf(keys, other))) == [48, 50], "alone it is the bass"


@pytest.mark.parametrize("name", [b"Bass Lead", b"Bass + Lead", b"Track 1"])
def test_bass_and_lead_is_a_bass_by_its_height(tmp_path: Path, name: bytes) -> None:
    """The program 88 of General MIDI is for both, and programs name tracks by it."""
    keys = named(b"Keys", 0, 60, 64, program=b"\0")
    low, high = named(name, 1, 28, 33, 40, program=b"\x57"), named(name, 2, 76, 79, 84, program=b"\x57")
    assert struck(read(tmp_path, smf(keys, high, low))) == [28, 33, 40]
    with pytest.raises(ScoreError, match="no bass notes"):
        read(tmp_path, smf(keys, high))
    bass = named(b"Bass", 3, 31, 35, program=b"\x50")
    assert struck(read(tmp_path, smf(keys, high, bass))) == [31, 35]


def style(*sections: tuple[str, tuple[int, ...]], casm: bytes, behind: bytes = b"") -> bytes:
    """A style: in each section, the keys 40 + channel on these channels at once, all with the program 34."""
    rows: list[tuple[int, tuple[int, ...]]] = [(0, meta(3, b"Own.sty")), (0, meta(6, b"SFF1")), (0, meta(6, b"SInt"))]
    for channel in range(8, 16):
        rows.append((0, (0xC0 | channel, 33)))
    for k, (name, channels) in enumerate(sections):
        rows.append((480 * (k + 1), meta(6, name.encode())))
        for channel in channels:
            rows += note_of(channel, 30 + channel, 480 * (k + 1), 480 * (k + 1) + 400)
    track = events(*sorted(rows, key=lambda row: row[0]))
    return smf(track, kind=0) + chunk(b"CASM", casm) + behind


def segment(names: str, *to: tuple[int, int], kind: bytes = b"Ctab") -> bytes:
    """A CSEG: for the sections, where each channel goes."""
    tables = b"".join(chunk(kind, bytes([source, *b"Part    ", part, *bytes(17)])) for source, part in to)
    return chunk(b"CSEG", chunk(b"Sdec", names.encode()) + tables)


@pytest.mark.parametrize("kind", [b"Ctab", b"Ctb2"])
def test_of_the_variants_of_a_styles_bass_the_first_is_played(tmp_path: Path, kind: bytes) -> None:
    """Section by section: another channel may be the first there; the tracks behind CASM set up the keyboard."""
    casm = segment("Main A,Fill In AA", (9, 9), (12, 10), (10, 10), (11, 11), kind=kind)
    casm += segment("Ending A", (13, 10), (11, 10), (10, 12), kind=kind)
    behind = chunk(b"OTSc", chunk(b"MTrk", events((0, (0xC0, 4)))))
    played = ("Main A", (10, 11, 12)), ("Fill In AA", (10, 11)), ("Ending A", (10, 11, 13)), ("Intro A", (10, 11))
    score = read(tmp_path, style(*played, casm=casm, behind=behind))
    assert struck(score) == [42, 40, 43, 40], "a section that CASM does not name has its bass on channel 11"
    (remark,) = score.remarks
    assert remark.startswith("is a Yamaha style: of up to 2 variants")
    assert struck(read(tmp_path, style(*played, casm=casm), 12)) == [41] * 4, "as asked for"


def test_a_style_with_one_bass_is_played_without_a_word(tmp_path: Path) -> None:
    score = read(tmp_path, style(("Main A", (9, 10)), ("Main B", (10,)), casm=segment("Main A,Main B", (10, 10))))
    assert struck(score) == [40, 40] and score.remarks == ()


def test_a_damaged_style_is_read_as_other_files(tmp_path: Path) -> None:
    """Its bass is what has a bass program."""
    for casm in (b"", b"CSEG", segment("Main A", (14, 11)), segment("Main A", (14, 11))[:-9], bytes(1 << 17)):
        assert struck(read(tmp_path, style(("Main A", (11,)), casm=casm))) == [41]


def test_an_instruments_name_counts_beside_the_tracks(tmp_path: Path) -> None:
    rows = [(0, meta(3, b"Track 3")), (0, meta(4, b"Electric Bass")), *line(1, (72, 74))]
    score = read(tmp_path, smf(events(*line(0, (60, 64))), events(*rows)))
    assert struck(score) == [72, 74] and 'called "Electric Bass"' in score.remarks[0]
    prefixed = [
        (0, meta(3, b"Song")),
        (0, meta(0x20, b"\x02")),
        (0, meta(3, b"Bass")),
        *line(0, (60,)),
        *line(2, (72,), start=300),
    ]
    assert struck(read(tmp_path, smf(events(*prefixed), kind=0))) == [72], "a name behind a channel prefix"


def turns(*rows: tuple[int, int, int]) -> bytes:
    """Bass lines of (channel, program, start)."""
    return smf(
        *(
            events((0, (0xB0 | channel, 7, 90)), *line(channel, LINE, program, start))
            for channel, program, start in rows
        )
    )


def test_basses_with_channels_of_their_own_take_turns(tmp_path: Path) -> None:
    """Slap, then fingers, then slap again: each part plays on its own bass."""
    score = read(tmp_path, turns((1, 36, 0), (2, 33, 960), (3, 36, 1920)), rate=RATE)
    assert score.program == 36 and score.changes == [(RATE, 33), (2 * RATE, 36)]
    assert struck(score) == 3 * list(LINE)
    kinds = (score.messages[:, 0] & 0xF0).tolist()
    assert kinds.count(0xB0) == 3 and kinds[kinds.index(0xC0) + 1] == 0x90


@pytest.mark.parametrize("starts", [(0, 0, 0), (0, 480, 960)])
def test_basses_that_play_together_share_the_bass_of_most_notes(tmp_path: Path, starts: tuple[int, int, int]) -> None:
    score = read(tmp_path, turns(*zip((1, 2, 3), (36, 33, 36), starts, strict=True)))
    assert score.program == 36 and score.changes == []


def test_a_bass_that_holds_notes_under_another_takes_no_turn(tmp_path: Path) -> None:
    held = [row for k in range(3) for row in note_of(2, 28, 2400 * k, 2400 * k + 2000)]
    data = smf(events(*line(1, LINE * 8, 33, 100)), events((0, (0xC2, 36)), *held))
    score = read(tmp_path, data)
    assert score.program == 33 and score.changes == []


def test_single_notes_are_no_turns(tmp_path: Path) -> None:
    rows = [row for k, key in enumerate(LINE * 3) for row in note_of(1 + k % 2, key, 240 * k, 240 * k + 200)]
    score = read(tmp_path, smf(events((0, (0xC1, 33)), (0, (0xC2, 36)), *rows)))
    assert score.program == 33 and score.changes == []


# ---- parts that double another one


@pytest.mark.parametrize("program", [33, None])
def test_a_bass_that_doubles_another_is_left_out(tmp_path: Path, program: int | None) -> None:
    """Some files have the bass twice, a little apart, for a fuller sound: on two channels, or on two tracks of one."""
    name = (0, meta(3, b"Bass"))
    for channel, late in ((2, 0), (1, 10), (4, 14), (3, 3)):
        first = events(name, (0, (0xB3, 7, 99)), *line(3, (*LINE, *LINE), program))
        second = events(name, (0, (0xB0 | channel, 7, 20)), *line(channel, (*LINE, *LINE), program, late))
        score = read(tmp_path, smf(first, second))
        kept = min(channel, 3) + 1
        which = f"track {1 + (channel < 3)} (channel {kept})"
        assert struck(score) == [*LINE, *LINE] and score.remarks[-1].endswith(f" doubles {which} and is left out")
        assert {m[0] & 15 for m in score.messages.tolist()} == {kept - 1}
        assert [p.why for p in read_parts(tmp_path / "song.mid")].count("doubles another part") == 1


def test_parts_with_other_notes_double_nothing(tmp_path: Path) -> None:
    """An octave apart, in turns, or later; and the same notes of a channel asked for."""
    first = events(*line(1, LINE, 33))
    for keys, start in ((tuple(key + 12 for key in LINE), 0), (LINE, 960), (LINE, 40)):
        assert len(struck(read(tmp_path, smf(first, events(*line(2, keys, 33, start)))))) == 8
    assert len(struck(read(tmp_path, smf(first, events(*line(2, LINE[:3], 33)))))) == 7, "too few to tell"
    data = smf(first, events(*line(2, LINE, 33)))
    assert len(struck(read(tmp_path, data, "all"))) == 8 and len(struck(read(tmp_path, data, 3))) == 4


def test_a_chart_of_a_music_game_is_refused(tmp_path: Path) -> None:
    """Its keys are buttons. A track called part is none."""
    for names in ((b"PART BASS", b"EVENTS"), (b"PART GUITAR", b"PART REAL_BASS"), (b"PART KEYS_ANIM_LH", b"BEAT")):
        with pytest.raises(ScoreError, match="is a chart for a music game"):
            read(tmp_path, smf(*(named(name, 0, 96, 97) for name in names)))
    for names in ((b"PART BASS", b"Piano"), (b"Part Bass", b"Part Guitar")):
        assert struck(read(tmp_path, smf(*(named(name, k, 40, 43) for k, name in enumerate(names)))))


# ---- files that are not MIDI

OTHERS = {
    b"\x18FICHIER GUITAR PRO v5.00\x00\x00": "is a Guitar Pro 5 file, not a MIDI file: export MIDI",
    b'<?xml version="1.0"?>\n<score-partwise version="3.1">': "is a MusicXML file, not a MIDI file: export MIDI",
    b'<?xml version="1.0"?><museScore version="4">': "not a MIDI file: export MIDI or MusicXML from the program",
    b"RIFF\x24\x00\x00\x00WAVEfmt ": "is a WAV file, not a MIDI file",
    b"G|---|\nD|-5-|\nA|---|\nE|---|": "is a text tab, which does not tell the lengths of its notes",
    b"hello, world": "not a Standard MIDI File",
}


@pytest.mark.parametrize("data", OTHERS)
def test_other_kinds_of_files_are_named(tmp_path: Path, data: bytes) -> None:
    with pytest.raises(ScoreError) as error:
        read(tmp_path, data)
    assert OTHERS[data] in str(error.value)


def test_a_name_tells_what_bytes_do_not(tmp_path: Path) -> None:
    (tmp_path / "song.GP5").write_bytes(b"hello, world")
    with pytest.raises(ScoreError, match="is a Guitar Pro 5 file, not a MIDI file: export MIDI"):
        read_score(tmp_path / "song.GP5", RATE)


# ---- one instrument over several channels, without a mode


def string_line(base: int, low_first: bool = False, length: int = 235) -> Rows:
    """A line over four strings, a channel each, as a MIDI guitar's track has it after its modes are lost."""
    opens, rows = (43, 38, 33, 28), []
    for k, (string, fret) in enumerate(
        [(3, 0), (3, 3), (2, 0), (2, 2), (1, 0), (1, 2), (0, 0), (0, 2), (3, 0), (2, 2)]
    ):
        channel = base + (3 - string if low_first else string)
        rows += note_of(channel, opens[string] + fret, 240 * k, 240 * k + length)
    return sorted(rows, key=lambda row: row[0])


def in_turn(channels: Sequence[int], length: int = 235) -> Rows:
    """The line, each note with a bend on the next of the channels, as MPE has it."""
    rows = []
    for k, key in enumerate((*LINE, *LINE)):
        channel = channels[k % len(channels)]
        rows += [(240 * k, (0xE0 | channel, 0, 64)), (240 * k, (0xB0 | channel, 74, 60))]
        rows += note_of(channel, key, 240 * k, 240 * k + length)
    return sorted(rows, key=lambda row: row[0])


@pytest.mark.parametrize("kind", [0, 1])
@pytest.mark.parametrize(
    "rows",
    [string_line(0), string_line(10), string_line(0, low_first=True), string_line(0, length=255), in_turn((0, 1)),
     [row for row in string_line(0) if row[1][0] & 15 > 1]],
    ids=["highest first", "from channel 11", "lowest first", "legato", "two in turn", "two strings"],
)  # fmt: skip
def test_a_channel_a_string_without_a_mode_is_one_instrument(tmp_path: Path, rows: Rows, kind: int) -> None:
    keys = [message[1] for _, message in rows if message[0] & 0xF0 == 0x90]
    others = [events(*line(15, (84, 86)))] if kind else []
    score = read(tmp_path, smf(events((0, meta(3, b"Take 3")), *rows), *others, kind=kind))
    assert struck(score) == keys and "as one instrument, a channel a string" in score.remarks[0]
    assert len({m[0] & 15 for m in score.messages.tolist()}) == len({m[0] & 15 for _, m in rows})
    drums = events(*line(9, (36, 38)))
    assert struck(read(tmp_path, smf(events(*rows), drums))) == keys


@pytest.mark.parametrize("length", [235, 700])
@pytest.mark.parametrize("channels", [range(1, 16), (3, 1, 2), (12, 14, 13, 15)])
def test_a_channel_a_note_without_a_mode_is_mpe(tmp_path: Path, channels: Sequence[int], length: int) -> None:
    """Chords, too: each channel bends its own notes."""
    rows = in_turn(channels, min(length, 240 * len(channels) - 5))
    score = read(tmp_path, smf(events(*rows)))
    assert sorted(struck(score)) == sorted([*LINE, *LINE]) and "a channel a note" in score.remarks[0]
    sent = [tuple(m) for m in score.messages.tolist() if m[0] == 0xB0]
    assert sent[:3] == [(0xB0, 101, 0), (0xB0, 100, 6), (0xB0, 6, max(channels[: len(rows) // 4]))]


def test_a_band_on_the_channels_of_a_track_is_not_one_instrument(tmp_path: Path) -> None:
    """Several lines at once, chords, a channel with a program, or notes that another track has there, too."""
    band = [*line(0, (55, 57, 59)), *line(1), *line(3, (48, 50, 52))]
    chords = [row for k, key in enumerate(LINE) for row in (*note_of(1, key, 480 * k, 480 * k + 200),
              *(r for third in (0, 4, 7) for r in note_of(2, 40 + third, 480 * k + 240, 480 * k + 440)))]  # fmt: skip
    for rows in (band, chords):
        score = read(tmp_path, smf(events(*sorted(rows, key=lambda row: row[0])), kind=0))
        assert struck(score) == list(LINE) and "in a bass's range" in score.remarks[0]
    for tracks in (
        [events((0, (0xC0, 0)), *string_line(0))],
        [events(*string_line(0)), events(*line(0, (84, 86)))],
    ):
        (remark,) = read(tmp_path, smf(*tracks)).remarks
        assert "in a bass's range" in remark
