"""The page reads MIDI files by the rules of `render`: the same messages, parts, choice, remarks and errors."""

from __future__ import annotations

import base64
import struct
import textwrap
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings
from support.node import run
from support.reading import differences, read_by_page, read_by_python
from support.smf import BASS, END, chunk, events, named, note_of, smf
from support.songs import damaged, make

from livebass import load_preset
from livebass.score.reading import TAKE

LINE = [40, 45, 47, 52]
NAMES = [
    b"Bass", b"", b"Piano", b"Basse", b"Contrabassoon", b"FINGERED BS", b"Drums", b"E-Bass", b"Baixo",
    "ベース".encode("cp932"), "ピアノ".encode("cp932"), "贝斯".encode("gb18030"), "Бас".encode("cp1251"),
    "бас-гитара".encode("koi8_r"), "低音吉他".encode("big5"), "베이스".encode("cp949"), b"Bas", "ベース".encode(),
    "\ufeffＢａｓｓ １\u2028".encode(), "BASSLİNE".encode(), "bası".encode(), ("é" * 50).encode(), b"cor de basse",
]  # fmt: skip
MANY = 600 if settings().max_examples < 400 else 2500  # files of each set; tools/test --all: 2500


def sysex(*data: int) -> tuple[int, ...]:
    return (0xF0, len(data) + 1, *data, 0xF7)


def line_of(channel: int, keys: list[int] = LINE, length: int = 240) -> list[tuple[int, tuple[int, ...]]]:
    return [row for k, key in enumerate(keys) for row in note_of(channel, key, k * length, (k + 1) * length)]


def by_tick(*rows: tuple[int, tuple[int, ...]]) -> list[tuple[int, tuple[int, ...]]]:
    return sorted(rows, key=lambda row: row[0])


def with_rows(*rows: tuple[int, tuple[int, ...]], channel: int = 0) -> bytes:
    """A one-track file: a line on a channel, and the events `rows`."""
    return smf(events(*by_tick(*rows, *line_of(channel))))


WELL_FORMED = smf(named(b"Bass", 2, *LINE), named(b"Drums", 9, 36, 38), BASS + named(b"", 0, 33, 35))


KINDS: dict[str, bytes] = {
    "program": smf(BASS + named(b"", 0, *LINE)),
    "plain clip": smf(named(b"MIDI 01", 0, *LINE)),
    "several without programs": smf(named(b"a", 0, 72, 76), named(b"b", 1, *LINE), named(b"c", 2, 50, 52)),
    "nothing low": smf(named(b"a", 0, 72, 76), named(b"b", 1, 80, 90)),
    "drums alone": smf(named(b"", 9, 36)),
    "no notes": smf(BASS + END),
    "empty": b"",
    "text": b"hello, world",
    "type 3": smf(BASS + END, kind=3),
    "patterns": smf(END, named(b"Bass", 0, *LINE), named(b"Bass", 0, 60), kind=2),
    "no division": smf(BASS + END, division=0),
    "odd frames": smf(BASS + END, division=0xEC28),
    "frames": smf(BASS + named(b"", 0, *LINE), division=0xE364),
    "ports": smf(
        b"\x00\xff\x21\x01\x00" + named(b"Piano", 0, 60, 64, program=b"\x00"),
        b"\x00\xff\x21\x01\x01" + named(b"Low", 0, *LINE, program=b"\x22"),
    ),
    "two basses on one channel of two ports": smf(
        b"\x00\xff\x21\x01\x00" + named(b"a", 0, 40, 45, program=b"\x20"),
        b"\x00\xff\x21\x01\x01" + named(b"b", 0, *LINE, program=b"\x22"),
    ),
    "programs of tracks": smf(
        events((0, (0xB0, 7, 90)), (480, (0xE0, 0, 80))),
        named(b"Organ", 0, 60, program=b"\x10"), named(b"Low", 0, *LINE, program=b"\x21"), named(b"Low 2", 0, 33),
    ),
    "bytes above 7F": smf(BASS + b"\x00\xb0\x07\xff\x00\xb0\x0a\xfe" + named(b"", 0, *LINE)),
    "system messages": smf(BASS + b"\x00\xfe\x00\xf2\x01\x02\x00\xf8" + named(b"", 0, *LINE)),
    "tempos": smf(b"\x00\xff\x51\x03\x00\x00\x00\x00\xff\x51\x04\x00\x01\x02\x03\x60\xff\x51\x03\x01\x02\x03" + END,
                  BASS + named(b"", 0, *LINE)),
    "longer middle track": smf(END, END, BASS + named(b"", 0, *LINE)).replace(
        (4).to_bytes(4), (9).to_bytes(4), 1),
    "shorter middle track": smf(END, named(b"Bass", 0, *LINE), END).replace(
        len(named(b"Bass", 0, *LINE)).to_bytes(4), (9).to_bytes(4)),
    "last track too long": smf(named(b"Bass", 0, *LINE)).replace(
        len(named(b"Bass", 0, *LINE)).to_bytes(4), (999).to_bytes(4)),
    "strays": b"MacBinary".ljust(128, b"\x00") + smf(END) + b"\x01\x02\x03" + chunk(b"MTrk", named(b"Bass", 0, *LINE)),
    "another file behind": WELL_FORMED + WELL_FORMED,
    "other chunk": smf(named(b"Bass", 0, *LINE)) + chunk(b"XFIH", b"abc"),
    "fewer tracks": smf(END, named(b"Bass", 0, *LINE)).replace(b"\x00\x02\x01", b"\x00\x05\x01", 1),
    "more tracks": smf(END, named(b"Bass", 0, *LINE)).replace(b"\x00\x02\x01", b"\x00\x00\x01", 1),
    "riff": b"RIFF" + struct.pack("<I", 999) + b"RMIDDISP" + struct.pack("<I", 3) + b"abc\x00data"
    + struct.pack("<I", len(WELL_FORMED)) + WELL_FORMED,
    "riff without data": b"RIFF....RMIDlist",
    "portamento time": with_rows((0, (0xC0, 33)), (0, (0xB0, 5, 0)), (240, (0xB0, 5, 64))),
    "kit by bank": smf(b"\x00\xb1\x00\x78" + named(b"", 1, 36, 38, program=b"\x21"), named(b"Bass", 2, *LINE)),
    "kit of XG": smf(b"\x00\xb1\x00\x7f" + named(b"", 1, 36, 38, program=b"\x21"), named(b"Bass", 2, *LINE)),
    "kit of GS": smf(events((0, sysex(0x41, 0x10, 0x42, 0x12, 0x40, 0x00, 0x7F, 0, 0x41)),
                            (1, sysex(0x41, 0x10, 0x42, 0x12, 0x40, 0x12, 0x15, 2, 0x17))),
                     b"\x02\xb1\x00\x7f" + named(b"", 1, 36, 38, program=b"\x21"), named(b"Bass", 2, *LINE)),
    "part of XG": smf(events((0, sysex(0x43, 0x10, 0x4C, 0, 0, 0x7E, 0)), (1, sysex(0x43, 0x10, 0x4C, 8, 1, 7, 1))),
                      b"\x02\xc1\x21" + named(b"", 1, 36, 38), named(b"Bass", 2, *LINE)),
    "melodic channel 10": smf(b"\x00\xb9\x00\x79" + named(b"", 9, *LINE, program=b"\x21")),
    "a bass on channel 10": smf(named(b"E-Bass", 9, *LINE), named(b"Pad", 0, 60, 64), named(b"Bass", 9, 36, 38)),
    "late program": with_rows((10, (0xC0, 33))),
    "programs later": with_rows((0, (0xC0, 33)), (240, (0xC0, 0)), (480, (0xC0, 36))),
    "tunings": with_rows((0, (0xC0, 33)), (0, sysex(0x7F, 0x7F, 4, 4, 0, 62)), (0, sysex(0x7E, 0x7F, 8, 2, 0, 0))),
    "one tuning": with_rows((0, (0xC0, 33)), (0, sysex(0x7F, 0x7F, 4, 3, 0x11, 0x30))),
    "tunings of GS and XG": with_rows((0, (0xC0, 33)), (0, sysex(0x41, 0x10, 0x42, 0x12, 0x40, 0, 0, 0, 3, 9, 1, 0)),
                                      (0, sysex(0x43, 0x10, 0x4C, 0, 0, 0, 0, 4, 0, 9))),
    "end after hours": smf(events((0, (0xC0, 33)), *line_of(0), (1 << 24, (0xB0, 7, 90)))),
    "days": smf(BASS + b"\x00\xff\x51\x03\xff\xff\xff" + b"\xff\xff\xff\x7f\x90\x28\x64"),
    "instrument": smf(b"\x00\xff\x04\x0dElectric Bass" + named(b"Track 1", 0, *LINE), named(b"Bassoon", 1, 40)),
    "named channels": smf(b"\x00\xff\x20\x01\x02\x00\xff\x03\x04Bass\x00\xff\x20\x01\x03\x00\xff\x03\x03Pad"
                          + events(*line_of(2)).removesuffix(END) + events(*line_of(3, [60, 62]))),
    "shared by names": smf(named(b"Bass", 0, *LINE), named(b"Piano", 0, 40, 52, 60)),
    "string channels": with_rows((0, (0xB0, 126, 4)), (0, (0xC0, 33)), *note_of(1, 45, 9, 70), *note_of(2, 50, 9, 9)),
    "MPE": with_rows((0, (0xB0, 101, 0)), (0, (0xB0, 100, 6)), (0, (0xB0, 6, 3)), *note_of(2, 50, 5, 600)),
    "string channels without a mode": smf(events(*by_tick(*[row for k, (channel, key) in enumerate(
        [(3, 28), (3, 31), (2, 33), (1, 38), (0, 43), (3, 30), (2, 35)])
        for row in note_of(channel, key, 240 * k, 240 * k + 250)]))),
    "MPE without a mode": smf(events(*by_tick(*[row for k, key in enumerate([*LINE, *LINE]) for row in
        ((120 * k, (0xE1 + k % 3, 0, 64)), *note_of(1 + k % 3, key, 120 * k, 120 * k + 300))]))),
    "foreign key switches": smf(events((0, (0xC0, 33)), *by_tick(*note_of(0, 25, 0, 20), *note_of(0, 96, 500, 900), *(
        row for k, key in enumerate(LINE) for row in note_of(0, key, 20 + 240 * k, 240 + 240 * k))))),
    "a bass doubled on another channel": smf(
        events((0, (0xC0, 33)), *line_of(0)), events((0, (0xC1, 38)), *((tick + 5, m) for tick, m in line_of(1))),
        named(b"Bass", 2, 60, 62)),
    "a bass doubled on its channel": smf(
        events((0, (0xC0, 33)), *line_of(0)), events(*((tick + 3, m) for tick, m in line_of(0)))),
    "a chart of a game": smf(named(b"PART BASS", 0, 96, 97), named(b"PART REAL_BASS_22", 0, 26), named(b"BEAT", 0, 12)),
    "a mode of a band": with_rows((0, (0xB0, 126, 3)), (0, (0xC0, 33)), (0, (0xC1, 0)), *note_of(1, 60, 5, 600)),
    "ended on another channel": smf(b"\x00\xc0\x21\x00\x90\x28\x60\x60\x81\x28\x30" + END),
    "overlaps": smf(events((0, (0xC0, 33)), (0, (0x90, 40, 9)), (100, (0x90, 40, 8)), (110, (0x80, 40, 7)),
                           (200, (0x80, 40, 6)), (200, (0x90, 40, 5)), (200, (0x80, 40, 4)), (300, (0x90, 41, 0)))),
    "hanging": smf(events((0, (0xC0, 33)), (5, (0x90, 40, 9)), (200, (0xB0, 7, 9)))),
    "low tuning": smf(events((0, (0xC0, 33)), *line_of(0, [19, 24, 26, 31, 24, 19, 43, 45]))),
    "key switches": smf(events((0, (0xC0, 33)), (0, (0x90, 24, 1)), (9, (0x80, 24, 1)), *line_of(0)[1:])),
    "a track in a track": smf(END + chunk(b"MTrk", BASS + named(b"", 0, *LINE)), END),
    "brief": smf(events((0, (0xC0, 33)), (0, (0x90, 40, 9)), (1, (0x80, 40, 9)), (10, (0x90, 40, 8))),
                 division=9600),
    "a name behind a named channel": smf(b"\x00\xff\x20\x01\x02\x00\xc1\x00" + named(b"Bass", 1, *LINE), END),
    "parts of GS while tempos change": smf(
        events((0, (0xFF, 0x51, 3, 9, 9, 9)), (200, sysex(0x41, 0x10, 0x42, 0x12, 0x40, 0x1A, 0x15, 1, 0)),
               (300, (0xFF, 0x51, 3, 1, 9, 9)), (400, (0xFF, 0x51, 3, 2, 9, 9))),
        events((0, (0xCA, 33)), *line_of(10)), events((0, (0xC0, 33)), *line_of(0))),
    "bank 127 of GS": smf(events((0, sysex(0x41, 0x10, 0x42, 0x12, 0x40, 0x00, 0x7F, 0, 0x41))),
                          events((0, (0xB1, 0, 127)), (0, (0xC1, 33)), *line_of(1))),
    "channel 10 of XG": smf(events((0, sysex(0x43, 0x10, 0x4C, 0, 0, 0x7E, 0))),
                            events((0, (0xB9, 0, 0)), (0, (0xC9, 33)), *line_of(9))),
    "take": smf(b"\x00\xff\x01" + bytes([len(TAKE)]) + TAKE.encode()
                + events((0, (0xB0, 5, 1)), (1, (0x90, 40, 9)), (5, (0x80, 40, 9)), (9, (0x93, 24, 9))))
}  # fmt: skip


SETS: dict[str, Callable[[], dict[str, bytes]]] = {
    "kinds": lambda: KINDS,
    "names": lambda: {repr(n): smf(named(b"Pad", 3, 72), named(n, 2, *LINE), named(b"Voice", 1, 41)) for n in NAMES},
    "made up": lambda: {str(seed): make(seed).data for seed in range(MANY)},
    "damaged": lambda: {str(seed): damaged(seed) for seed in range(MANY)},
}


@pytest.mark.parametrize("kind", SETS)
def test_the_page_reads_files_as_render_does(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no name tells the encoding, Python guesses one, which the page does not."""
    monkeypatch.setattr("charset_normalizer.from_bytes", lambda _: ())
    bass = load_preset("jazz-finger")
    files = SETS[kind]()
    on_page = read_by_page(files.values(), bass)
    path, wrong = tmp_path / "song.mid", []
    for (name, data), found in zip(files.items(), on_page, strict=True):
        path.write_bytes(data)
        wrong += [f"{name}: {line}" for line in differences(read_by_python(path, bass), found)]
    assert not wrong


def test_each_part_can_be_picked() -> None:
    """A chosen part has all its notes, each with its end, and no others; the choice comes first."""
    script = """
      import {Kernels} from "./kernels.js";
      import {Song} from "./song.js";

      export const run = (instance, files) => files.map(file => {
        let song;
        try {
          song = new Song(Uint8Array.from(atob(file), c => c.charCodeAt(0)).buffer, 48000, new Kernels(instance()));
        } catch (error) {
          return [[], []]; // it has no notes
        }
        const bass = {range: [0, 127], switches: []};
        return [song.choices(bass).map(([value]) => value), song.parts().map(({key, notes}) =>
          [key, notes, [...song.messages(key, bass)]])];
      });
    """
    files = [make(seed).data for seed in range(60)] + [KINDS["shared by names"], KINDS["string channels"]]
    packed = [base64.b64encode(data).decode() for data in files]
    found = run(textwrap.dedent(script), packed)
    assert sum(len(parts) for _, parts in found) > 60
    for values, parts in found:
        assert [value for value in values if value != "auto"] == [key for key, *_ in parts if key in values]
        assert len(values) in (len(parts), len(parts) + 1)
        for _, notes, numbers in parts:
            messages = [numbers[k + 1 : k + 4] for k in range(0, len(numbers), 4)]
            struck = [m[0] & 0xF0 for m in messages]
            assert struck.count(0x90) == notes and 0 < struck.count(0x80) <= notes
            down: set[tuple[int, int]] = set()
            for status, key, *_ in messages:
                if status & 0xF0 == 0x90:
                    down.add((status & 0x0F, key))
                elif status & 0xF0 == 0x80:
                    down.discard((status & 0x0F, key))
            assert not down
