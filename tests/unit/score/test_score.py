"""Standard MIDI Files as annotated bytes, and the scores read from them; damaged files give one clear error."""

from __future__ import annotations

import io
import os
import random
from dataclasses import replace
from pathlib import Path

import mido
import numpy as np
import pytest
from support.messages import messages_of
from support.smf import BASS, END, chunk, events, named, note_of, read, smf, struck

from livebass import Quality, load_preset, render_to_array
from livebass.kernels.score.memory import TIMED
from livebass.score.phrases import demo_score
from livebass.score.reading import ScoreError, read_parts, read_score
from livebass.score.score import clean_events, score_of, single_note
from livebass.score.smf import parse_smf
from livebass.score.tracknames import decode, is_bass

RATE = 48000


def test_one_note_with_a_tempo_and_running_status(tmp_path: Path) -> None:
    track = (
        b"\x00\xff\x51\x03\x0f\x42\x40"  # at 0: 1000000 us a quarter, 60 a minute
        b"\x00\xff\x03\x04line"  # track name
        b"\x00\xc0\x21"  # program 33
        b"\x00\x90\x28\x64"  # note 40 on, velocity 100
        b"\x83\x60\x28\x00"  # 480 ticks later, running status: velocity 0, that is off
        b"\x00\x2b\x50"  # running status: note 43 on
        b"\x81\x70\x80\x2b\x40"  # 240 ticks later: note 43 off
        b"\x00\xff\x2f\x00"
    )
    score = read(tmp_path, smf(track, kind=0))
    played = [(0, 0x90, 40, 100), (48000, 0x80, 40, 64), (48000, 0x90, 43, 80), (72000, 0x80, 43, 64)]
    assert messages_of(score) == played
    assert (score.notes, score.end_frame, score.name, score.rate, score.program) == (2, 72000, "song", RATE, 33)
    assert score.frames.dtype == np.int64 and score.messages.dtype == np.uint8


def test_tempo_changes_in_another_track(tmp_path: Path) -> None:
    tempi = (
        b"\x00\xff\x51\x03\x07\xa1\x20"  # 500000 us
        b"\x83\x60\xff\x51\x03\x0f\x42\x40" + END  # at 480: 1000000 us
    )
    line = BASS + b"\x00\x90\x28\x64\x87\x40\x80\x28\x40" + END  # 960 ticks long
    assert read(tmp_path, smf(tempi, line)).end_frame == round(1.5 * RATE)


@pytest.mark.parametrize(
    ("division", "ticks_per_second"),
    [(0xE728, 25 * 40), (0xE850, 24 * 80), (0xE250, 30 * 80), (0xE364, 30000 / 1001 * 100)],
)
def test_smpte_time_ignores_the_tempo(tmp_path: Path, division: int, ticks_per_second: float) -> None:
    line = b"\x00\xff\x51\x03\x0f\x42\x40" + BASS + b"\x00\x90\x28\x64\x8f\x50\x80\x28\x40" + END  # 2000 ticks
    assert read(tmp_path, smf(line, division=division)).end_frame == round(2000 / ticks_per_second * RATE)


def test_hours_do_not_drift(tmp_path: Path) -> None:
    """10000 quarters of 333333 us: the last frame is right within one half."""
    ticks = (4_800_000).to_bytes(4)
    bits = int.from_bytes(ticks)
    delta = bytes([bits >> 21 & 0x7F | 0x80, bits >> 14 & 0x7F | 0x80, bits >> 7 & 0x7F | 0x80, bits & 0x7F])
    line = b"\x00\xff\x51\x03\x05\x16\x15" + BASS + delta + b"\x90\x28\x64\x00\x80\x28\x40" + END
    assert read(tmp_path, smf(line)).frames[0] == round(3333.33 * RATE)


def test_unknown_chunks_escapes_and_odd_metadata_are_passed_over(tmp_path: Path) -> None:
    line = (
        b"\x00\xff\x59\x02\x7f\x09"  # a key signature that does not exist
        b"\x00\xff\x20\x00"  # a channel prefix without a channel
        b"\x00\xf0\x03\x7e\x7f\xf7"  # system exclusive
        b"\x00\xf7\x02\xf3\x01" + BASS + b"\x00\x90\x28\x64"  # escape: a song select, data above 127
        b"\x81\x70\xff\x01\x02hi"  # text between does not end ...
        b"\x81\x70\x28\x00"  # ... running status
    )  # and no end of track
    data = smf(line)
    data = data[:14] + chunk(b"XFIH", b"anything") + data[14:] + b"trailing"
    assert read(tmp_path, data).end_frame == RATE // 2


def test_events_of_one_frame_are_ordered(tmp_path: Path) -> None:
    """Controllers, then note-offs, then note-ons, whatever the order in the file."""
    line = (
        BASS + b"\x00\x90\x28\x64"
        b"\x83\x60\x90\x28\x50"  # struck again before ...
        b"\x00\x80\x28\x40"  # ... the off of the first
        b"\x00\xb0\x40\x7f"  # pedal
        b"\x83\x60\x80\x28\x40" + END
    )
    assert [r[:3] for r in messages_of(read(tmp_path, smf(line)))] == [
        (0, 0x90, 40), (24000, 0xB0, 64), (24000, 0x80, 40), (24000, 0x90, 40), (48000, 0x80, 40),
    ]  # fmt: skip


def ends_of(strokes: list[tuple[int, bool, int]], end: int = 9000, rate: int = RATE) -> list[tuple[int, int]]:
    """(frame, release velocity) of the note-offs of one key, (frame, on, velocity), in a file of `end` frames."""
    rows = np.zeros(len(strokes), TIMED)
    for row, (frame, on, velocity) in zip(rows, strokes, strict=True):
        row["frame"], row["status"], row["first"], row["second"] = frame, 0x90 if on else 0x80, 40, velocity
    ends = clean_events(rows, rate, end)
    return [(row["frame"], row["second"]) for row in ends[ends["status"] == 0x80]]


ENDS = {
    # name: (strokes of one key as "frame+" on, "frame-" off), ends with 48 frames least and a file of 9000
    "plain": ("0+ 480-", [480]),
    "zero length": ("0+ 0-", [48]),
    "shorter than brief": ("0+ 20-", [48]),
    "zero length, struck again": ("0+ 0- 20+ 480-", [20, 480]),
    "orphan offs": ("0- 10- 20+ 480- 500-", [480]),
    "never ends": ("0+", [9000]),
    "struck again at its end": ("0+ 480- 480+ 960-", [480, 960]),
    "the same, on first": ("0+ 480+ 480- 960+ 960- 1440-", [480, 960, 1440]),
    "overlap: the first off is the first note's": ("0+ 480+ 500- 960-", [960]),
    "struck three times, one off": ("0+ 480+ 960+ 1440-", [1440]),
    "doubled note": ("0+ 0+ 480- 480-", [480]),
}


@pytest.mark.parametrize("name", ENDS)
def test_ends_of_one_key(name: str) -> None:
    strokes, expected = ENDS[name]
    ends = ends_of([(int(s[:-1]), s[-1] == "+", 90) for s in strokes.split()])
    assert [frame for frame, _ in ends] == expected


@pytest.mark.parametrize(
    ("strokes", "expected"),
    [
        ("0+90 480-20", [(480, 20)]),
        ("0+90 480-20 480+90 960-127", [(480, 20), (960, 127)]),
        ("0+90 480+90 500-20 960-0", [(960, 0)]),
        ("0+90 0-33 20+90 480-44", [(20, 33), (480, 44)]),
        ("0+90 480-5 480-6", [(480, 5)]),
        ("0+90", [(9000, 64)]),
    ],
)
def test_a_note_has_the_release_velocity_of_the_note_off_that_ends_it(
    strokes: str, expected: list[tuple[int, int]]
) -> None:
    pairs = [(s.replace("+", "-").split("-"), "+" in s) for s in strokes.split()]
    assert ends_of([(int(frame), on, int(velocity)) for (frame, velocity), on in pairs]) == expected


@pytest.mark.parametrize("seed", range(50))
def test_every_note_on_is_ended(seed: int) -> None:
    rng = random.Random(seed)
    strokes = sorted(((rng.randrange(300), rng.random() < 0.5, 64) for _ in range(40)), key=lambda s: s[0])
    strokes.append((300, False, 64))
    ends = [frame for frame, _ in ends_of(strokes, 300, 5000)]
    assert ends == sorted(ends)
    last_on = max((f for f, on, _ in strokes if on), default=None)
    assert last_on is None or ends[-1] > last_on


def three_channels() -> bytes:
    piano = b"\x00\xc3\x00\x00\x93\x3c\x64\x83\x60\x83\x3c\x40" + END
    bass = (
        b"\x00\xc1\x00\x00\x91\x30\x64\x83\x60\x81\x30\x40"  # channel 2 begins as a piano ...
        b"\x00\xb1\x07\x50\x00\xc1\x27\x00\x91\x28\x64\x83\x60\x81\x28\x40" + END  # ... and turns into program 39
    )
    drums = b"\x00\xc9\x20\x00\x99\x24\x64\x83\x60\x89\x24\x40" + END  # program 32 on channel 10: still drums
    return smf(piano, bass, drums)


@pytest.mark.parametrize(
    ("channel", "notes"), [("auto", [40]), ("all", [48, 60, 40]), (2, [48, 40]), (4, [60]), (10, [36])]
)
def test_channels(tmp_path: Path, channel: str | int, notes: list[int]) -> None:
    score = read(tmp_path, three_channels(), channel)
    assert sorted(struck(score)) == sorted(notes) and score.notes == len(notes)
    channels = {40: 1, 48: 1, 60: 3, 36: 9}
    assert {(m[0] & 0x0F, m[1]) for m in score.messages.tolist() if m[0] & 0xF0 == 0x90} == {
        (channels[note], note) for note in notes
    }
    assert any(m[0] & 0xF0 == 0xB0 for m in score.messages) == (channel in ("auto", "all", 2))


def test_a_program_set_at_the_same_tick_by_a_later_track_counts(tmp_path: Path) -> None:
    line = b"\x00\x90\x28\x64\x83\x60\x80\x28\x40" + END
    assert read(tmp_path, smf(line, BASS + END)).notes == 1


LINE = BASS + b"\x00\x90\x28\x64\x83\x60\x80\x28\x40" + END
BAD = {
    # name: (bytes, the message's text)
    "nothing": (b"", "empty"),
    "text": (b"hello, world", "not a Standard MIDI File"),
    "riff": (b"RIFF....RMIDlist", "RIFF file without a chunk of MIDI data"),
    "half a header": (smf(LINE)[:9], "truncated"),
    "no track": (smf(LINE)[:14], "track 1 of 1, byte 14: chunk name of 4 bytes, 0 left"),
    "track cut off": (smf(LINE)[:-6], "track 1 of 1, byte 22: chunk of 16 bytes, 10 left"),
    "event cut off": (smf(LINE[:9] + b"\x90"), "track 1 of 1, byte 32: message"),
    "type 3": (smf(LINE, kind=3), "its type must be 0 (one track), 1 (tracks together) or 2 (patterns), not 3"),
    "no division": (smf(LINE, division=0), "ticks per quarter note must be from 1 to 32767, not 0"),
    "odd smpte": (smf(LINE, division=0xEC28), "24, 25, 29 or 30 frames of 1 to 255 ticks, not 20 of 40"),
    "no running status": (smf(b"\x00\x40\x40"), "byte 23: data byte 0x40 without"),
    "long delta": (smf(b"\xff\xff\xff\xff\x7f"), "longer than 4 bytes"),
    "no notes": (smf(BASS + END), "has no notes"),
    "no bass": (
        smf(named(b"", 0, 64), named(b"", 1, 64)),
        "no bass notes: no channel has a bass program, 33 to 40, and no track is called bass; use --channel N or "
        "--channel all; there is channel 1 (no program, 1 note, E4), channel 2 (no program",
    ),
    "days": (smf(BASS + b"\x00\xff\x51\x03\xff\xff\xff" + b"\xff\xff\xff\x7f\x90\x28\x64"), "hours, more than 24"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_files(tmp_path: Path, name: str) -> None:
    data, says = BAD[name]
    with pytest.raises(ScoreError) as error:
        read(tmp_path, data)
    text = str(error.value)
    assert says in text and "song.mid" in text and "\n" not in text


def test_bad_paths(tmp_path: Path) -> None:
    for path, says in [
        (tmp_path, "is a directory"),
        (tmp_path / "none.mid", "No such file"),
        (tmp_path / "none.mid" / "deeper", "No such file"),
        (Path("/dev/null"), "not a regular file"),
        (Path("zero\0byte"), "cannot be read"),
    ]:
        with pytest.raises(ScoreError, match=says):
            read_score(path, RATE)
    huge = tmp_path / "huge.mid"
    with huge.open("wb") as file:
        os.truncate(file.fileno(), 100 << 20)
    with pytest.raises(ScoreError, match="has 100 MB, more than 64 MB"):
        read_score(huge, RATE)


def test_damaged_files_give_a_score_or_a_clear_error(tmp_path: Path) -> None:
    """Truncations at every byte, and random bytes in random places."""
    whole = three_channels()
    rng = random.Random(1)
    cases = [whole[:n] for n in range(len(whole))]
    for _ in range(1000):
        data = bytearray(whole)
        for _ in range(rng.randint(1, 6)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        cases.append(bytes(data))
    path = tmp_path / "damaged.mid"
    good = 0
    for data in cases:
        path.write_bytes(data)
        try:
            score = read_score(path, RATE, "all")
        except ScoreError as error:
            assert "\n" not in str(error)
            continue
        good += 1
        assert (np.diff(score.frames) >= 0).all() and 0 <= score.end_frame <= 24 * 3600 * RATE + RATE
        assert (score.messages[:, 1:] < 128).all() and score.notes > 0
    assert good > 100


def test_agrees_with_another_reader() -> None:
    """The events of a random file equal those written by mido."""
    rng = random.Random(2)
    file = mido.MidiFile(type=1, ticks_per_beat=96)
    expected = []
    for channel in range(3):
        track, tick = file.add_track(f"line {channel}"), 0
        for _ in range(200):
            delta, note = rng.choice((0, 3, 200, 40000)), rng.randrange(128)
            kind = rng.choice(("note_on", "note_off", "control_change", "program_change", "pitchwheel"))
            values: dict[str, int] = {
                "note_on": {"note": note, "velocity": rng.randrange(128)},
                "note_off": {"note": note, "velocity": 3},
                "control_change": {"control": note, "value": 5},
                "program_change": {"program": note},
                "pitchwheel": {"pitch": rng.randrange(-8192, 8192)},
            }[kind]
            message = mido.Message(kind, channel=channel, time=delta, **values)
            track.append(message)
            tick += delta
            expected.append((tick, (*message.bytes(), 0)[:3], channel))
    buffer = io.BytesIO()
    file.save(file=buffer)
    read = [(tick, tuple(data), track) for tick, track, _, *data in parse_smf(buffer.getvalue()).rows.tolist()]
    assert read == sorted(expected, key=lambda e: e[0])


def test_single_note() -> None:
    assert messages_of(single_note(43, 110, 3.0, RATE)) == [(0, 0x90, 43, 110), (144000, 0x80, 43, 64)]
    assert single_note(43, 110, 0.0, RATE).end_frame == 48


@pytest.mark.parametrize("bad", [(0, 1, 128, 100), (0, 1, 40, 0), (0, float("nan"), 40, 100), (-1, 1, 40, 100)])
def test_notes_out_of_range(bad: tuple[float, float, int, int]) -> None:
    with pytest.raises(ValueError, match=r"must be (a whole number )?from "):
        score_of([bad], RATE)


def test_a_chord_of_all_notes(tmp_path: Path) -> None:
    line = BASS + b"".join(b"\x00\x90" + bytes([n, 100]) for n in range(128))
    line += b"\x83\x60\x80\x00\x40" + b"".join(b"\x00" + bytes([n, 64]) for n in range(1, 128)) + END
    score = read(tmp_path, smf(line))
    assert score.notes == 128 and len(score.frames) == 256


@pytest.mark.parametrize("style", ["finger", "slap"])
def test_demo_phrases_have_soft_and_hard_notes_on_all_strings(style: str) -> None:
    score = demo_score(RATE, style)
    on = score.messages[score.messages[:, 0] == 0x90]
    assert 6 < score.end_frame / RATE < 10
    assert on[:, 2].min() < 40 and on[:, 2].max() > 115
    assert on[:, 1].min() >= 28 and on[:, 1].max() <= 63
    for lowest in (28, 33, 38, 43):
        assert (on[:, 1] >= lowest).any()
    assert (score.messages[:, 0] == 0xE0).any()
    with pytest.raises(ValueError, match="style must be finger, slap or"):
        demo_score(RATE, "bowed")


@pytest.mark.parametrize(
    ("name", "is_bass"),
    [
        (b"Bass", True), (b"BASS", True), (b"E-Bass", True), (b"Bass Guitar", True), (b"my bass_2", True),
        (b"bassline", True), (b"Ebass", True), (b"Slap Bass 1", True), (b"Bassgitarre", True),
        (b"Bassoon", False), (b"Contrabassoon", False), (b"Bass Drum", False), (b"bass-drum", False),
        (b"Bass Clarinet", False), (b"Piano", False), (b"", False), (b"embassy", False), (b"\xff\xfe", False),
    ],
)  # fmt: skip
def test_without_a_bass_program_a_track_called_bass_is_played(tmp_path: Path, name: bytes, is_bass: bool) -> None:
    """The tracks share a channel: the piano's note-offs must not end the bass's notes."""
    piano = b"\x00\xff\x03\x05Piano" + b"\x00\x90\x28\x64\x10\x80\x28\x40\x00\x90\x3c\x64\x60\x80\x3c\x00" + END
    score = read(tmp_path, smf(piano, named(name, 0, 40, 43)))
    if not is_bass:
        assert "no track is called bass" in score.remarks[0]
        return
    assert struck(score) == [40, 43] and score.program is None
    assert messages_of(score)[1] == (4800, 0x80, 40, 0)  # 96 ticks of 480 a quarter
    (remark,) = score.remarks
    assert remark.endswith(f'plays the track called "{name.decode()}"') and "33 to 40" in remark


def test_letters_of_a_latin_word_do_not_tell_an_encoding() -> None:
    """A Latvian name's bytes are Japanese text too: a word that begins in Latin letters proves nothing."""
    (name,) = decode(["Basgitāra".encode("cp1257")])
    assert name.startswith("Basgit") and name.endswith("ra") and is_bass(name)
    assert decode(["Ｂ. 베이스".encode("cp949"), "똠".encode("cp949")])[1] == "똠", "cp949 has more letters than EUC-KR"


def test_a_bass_program_goes_before_a_name(tmp_path: Path) -> None:
    score = read(tmp_path, smf(named(b"Bass", 0, 40), named(b"Lead", 1, 50, program=b"\x21")))
    assert struck(score) == [50] and score.program == 33 and score.remarks == ()


def test_drums_and_a_whole_piece_called_bass_are_none(tmp_path: Path) -> None:
    for data in (
        smf(named(b"Bass", 9, 40)),
        smf(b"\x00\x90\x48\x64\x10\x80\x48\x40" + named(b"All about that bass", 1, 72), kind=0),
    ):
        with pytest.raises(ScoreError, match="no bass notes"):
            read(tmp_path, data)


def test_the_error_names_tracks_programs_and_ranges(tmp_path: Path) -> None:
    data = smf(named(b"Grand \xc3\xa9tude\n", 0, 60, 64, 67, program=b"\x00"), named(b"Kit", 9, 36), named(b"", 2, 62))
    with pytest.raises(ScoreError) as error:
        read(tmp_path, data)
    assert str(error.value).endswith(
        'there is channel 1 "Grand étude" (program 1, 3 notes, C4 to G4), channel 3 (no program, 1 note, D4), '
        'channel 10 "Kit" (drums, 1 note, C2)'
    )
    with pytest.raises(ScoreError, match=r"no notes on channel 2; there is channel 1 \"Grand"):
        read(tmp_path, data, 2)
    with pytest.raises(ScoreError, match="and 2 more, see render --list") as error:
        read(tmp_path, smf(*[named(b"Choir", channel, 60) for channel in (0, 1, 2, 3, 4, 5, 6, 7, 8, 10)]))
    assert "\n" not in str(error.value)


def test_parts_are_listed_with_what_would_be_played(tmp_path: Path) -> None:
    path = tmp_path / "song.mid"
    path.write_bytes(three_channels())
    parts = read_parts(path)
    assert [(p.channel, p.track, p.programs, p.notes, p.chosen, p.range) for p in parts] == [
        (2, 2, (1, 40), 2, 1, "E2 to C3"), (4, 1, (1,), 1, 0, "C4"), (10, 3, (33,), 1, 0, "C2"),
    ]  # fmt: skip
    assert [p.chosen for p in read_parts(path, "all")] == [2, 1, 0]
    assert [p.chosen for p in read_parts(path, 10)] == [0, 0, 1]
    path.write_bytes(smf(named(b"Piano", 0, 60), named(b"Flute", 1, 72)))
    assert [p.chosen for p in read_parts(path)] == [0, 0]  # no error
    path.write_bytes(smf(BASS + END))
    assert read_parts(path) == []


def test_a_header_that_promises_too_many_tracks_is_played_with_a_warning(tmp_path: Path) -> None:
    data = smf(LINE, LINE)
    data = data[:10] + (5).to_bytes(2) + data[12:]
    for rest in (b"", b"\0\0", chunk(b"XFIH", b"anything"), b"XFIH\0\0\xff\xffcut"):
        score = read(tmp_path, data + rest)
        assert struck(score) == [40, 40]
        assert score.remarks == ("has 2 of the 5 tracks that its header promises",)
    assert read(tmp_path, smf(LINE, LINE)).remarks == ()


def test_a_last_track_that_claims_too_much_is_played_with_a_warning(tmp_path: Path) -> None:
    """It plays if its events end within the file; cut off in mid-event it is refused, as in "track cut off" above."""
    data = smf(LINE, LINE)
    at = data.rindex(b"MTrk") + 4
    for claimed in (len(LINE) + 1, 2**32 - 1):
        score = read(tmp_path, data[:at] + claimed.to_bytes(4) + data[at + 4 :])
        assert struck(score) == [40, 40] and len(messages_of(score)) == len(messages_of(read(tmp_path, data)))
        assert score.remarks == (f"track 2 of 2 is {claimed - len(LINE)} bytes shorter than it says",)
    whole = data[: -len(END)]  # a file cut between two events
    assert read(tmp_path, whole).remarks == ("track 2 of 2 is 4 bytes shorter than it says",)


# ---- modes, programs in mid-file, key switches


def guitar(*more: tuple[int, tuple[int, ...]], mode: tuple[tuple[int, int], ...] = ((126, 4),)) -> bytes:
    """Notes on channels 1 to 4, joined into one instrument by a mode on channel 1, and the events `more`."""
    rows: list[tuple[int, tuple[int, ...]]] = [(0, (0xB0, *message)) for message in mode]
    for channel, key in enumerate((43, 38, 33, 28)):
        begin = 100 * channel
        rows += [*note_of(channel, key, begin, begin + 80), (begin + 40, (0xE0 | channel, 0, 80))]
    return smf(events(*sorted([*rows, *more], key=lambda row: row[0])))


MPE = ((101, 0), (100, 6), (6, 3))  # channels 2 to 4 have notes, 1 is their master


@pytest.mark.parametrize("mode", [((126, 4),), MPE], ids=["strings", "notes"])
@pytest.mark.parametrize("programs", [(), (0,), (3,), (0, 1, 2, 3)])
def test_a_file_that_sets_a_mode_is_one_instrument(
    tmp_path: Path, mode: tuple[tuple[int, int], ...], programs: tuple[int, ...]
) -> None:
    """Its program is on its master, on any of its channels, or on none."""
    data = guitar(*[(0, (0xC0 | channel, 33)) for channel in programs], mode=mode)
    score = read(tmp_path, data)
    assert score.program == (33 if programs else None) and score.changes == []
    assert struck(score) == [43, 38, 33, 28] and score.remarks == ()
    assert [m[0] for m in score.messages.tolist() if m[0] & 0xF0 == 0x90] == [0x90, 0x91, 0x92, 0x93]
    assert [m[0] for m in score.messages.tolist() if m[0] & 0xF0 == 0xE0] == [0xE0, 0xE1, 0xE2, 0xE3]
    assert [tuple(m) for m in score.messages.tolist() if m[0] & 0xF0 == 0xB0] == [(0xB0, *m) for m in mode]
    one = read(tmp_path, data, 2)
    assert struck(one) == [38], "that channel's notes, played as its zone is"
    assert [tuple(m) for m in one.messages.tolist() if m[0] == 0xB0] == [(0xB0, *m) for m in mode]


def test_a_zone_may_have_the_channel_of_the_drums(tmp_path: Path) -> None:
    rows = [(0, (0xB0, *message)) for message in ((101, 0), (100, 6), (6, 15))]
    score = read(tmp_path, smf(events(*rows, (0, (0xC0, 33)), *note_of(9, 40, 0, 80), *note_of(8, 41, 90, 99))))
    assert struck(score) == [40, 41]


def test_a_mode_that_cannot_be_meant_is_left_out(tmp_path: Path) -> None:
    """Its channels hold parts of a band: some are basses, and some are not."""
    for mode in (((126, 4),), MPE):
        data = guitar((0, (0xC0, 0)), (0, (0xC1, 33)), (0, (0xC2, 25)), (0, (0xC3, 33)), mode=mode)
        for channel, keys in (("auto", [38, 28]), ("all", [43, 38, 33, 28])):
            score = read(tmp_path, data, channel)
            sent = {tuple(m[1:]) for m in score.messages.tolist() if m[0] & 0xF0 == 0xB0}
            assert struck(score) == keys and not sent & {(126, 4), (6, 3)}


def test_a_file_of_one_channel_sounds_the_same_on_any(tmp_path: Path) -> None:
    rng = random.Random(4)
    rows: list[tuple[int, tuple[int, ...]]] = [(0, (0xC5, 33))]
    for tick in sorted(rng.randrange(900) for _ in range(120)):
        channel, value = 5, rng.randrange(128)
        kinds: list[tuple[int, ...]] = [
            *[(0x90, rng.randrange(28, 60), value)] * 4, *[(0x80, rng.randrange(28, 60), value)] * 3, (0xE0, 0, value),
            (0xB0, rng.choice((1, 7, 11, 64, 68, 74, 100, 101, 6, 126, 127)), value % 2), (0xD0, value),
        ]  # fmt: skip
        status, *data = rng.choice(kinds)
        rows.append((tick, (status | channel, *data)))
    score = read(tmp_path, smf(events(*rows)))
    folded = replace(score, messages=score.messages & np.array([0xF0, 0xFF, 0xFF], np.uint8))
    assert {m[0] & 0x0F for m in score.messages.tolist()} == {5}
    bass, quality = load_preset("jazz-finger"), Quality("light", 60, 192e3)
    assert np.array_equal(*(render_to_array(bass, s, quality, tail=0.1) for s in (score, folded)))


def test_the_programs_after_the_first_note_are_changes(tmp_path: Path) -> None:
    """Except those before it, those without effect, and those without a note before the next."""
    track = events(
        (0, (0xC0, 32)), (0, (0xC0, 33)), *note_of(0, 40, 10, 50), (60, (0xC0, 33)), *note_of(0, 41, 60, 90),
        (100, (0xC0, 35)), (110, (0xC0, 36)), *note_of(0, 42, 120, 130), (140, (0xC0, 37)), *note_of(0, 43, 240, 280),
        (300, (0xC0, 32)),
    )  # fmt: skip
    score = read(tmp_path, smf(track), rate=48000)
    assert score.program == 33 and score.changes == [(5500, 36), (7000, 37)]
    assert [m[1] for m in score.messages.tolist() if m[0] == 0xC0] == [36, 37]
    alone = score.on_one_bass()
    assert alone.changes == [] and struck(alone) == struck(score) == [40, 41, 42, 43]
    parts = (*note_of(1, 50, 0, 10), (20, (0xC1, 36)), *note_of(1, 51, 30, 40), *note_of(1, 52, 50, 60))
    several = smf(events((0, (0xC0, 35)), *note_of(0, 40, 0, 5)), events((0, (0xC1, 33)), *parts[:2], *parts[2:]))
    score = read(tmp_path, several, "all")
    assert score.program in (33, 35) and score.changes == [(1000, 36)]


def test_key_switches_are_listed_apart(tmp_path: Path) -> None:
    path = tmp_path / "song.mid"
    path.write_bytes(smf(named(b"Bass", 0, 10, 40, 12, 43, program=b"\x21"), named(b"Keys", 1, 10, program=b"\x21")))
    assert [(p.notes, p.switches, p.range, p.chosen) for p in read_parts(path)] == [
        (4, 0, "A#-1 to G2", 4), (1, 0, "A#-1", 1),
    ]  # fmt: skip
    assert [(p.notes, p.switches, p.range, p.chosen) for p in read_parts(path, "auto", {10, 12, 99})] == [
        (2, 2, "E2 to G2", 2), (0, 1, "", 0),
    ]  # fmt: skip
