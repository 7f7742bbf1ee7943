"""Sound files: read as written, the same bytes each time, whole or not at all; transactions and signals."""

from __future__ import annotations

import io
import os
import shlex
import signal
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import small_files
from support.needs import CLOSED

from livebass.files.whole import OutputError, Transaction
from livebass.sound import audiofile
from livebass.sound.audiofile import AudioWriter, Sound, SoundError, encoding, read_sound
from livebass.system.interrupts import STOPS

RATE = 48000
SOUND = (0.5 * np.sin(np.arange(100_000) * 0.05)).astype(np.float32)
KINDS = [("wav", "16", 2**-15), ("wav", "24", 2**-23), ("wav", "float", 0), ("flac", "16", 2**-15),
         ("flac", "24", 2**-23), ("ogg", None, 0.1)]  # fmt: skip


def save(path: Path, bits: str | None = None, sound: np.ndarray = SOUND, rate: int = RATE) -> AudioWriter:
    with Transaction() as files:
        writer = AudioWriter(files, path, encoding(path, rate, bits=bits))
        for start in range(0, len(sound), 5000):
            writer.write(sound[start : start + 5000])
        writer.close()
    return writer


@pytest.mark.parametrize(("kind", "bits", "error"), KINDS)
def test_what_is_written_is_read(tmp_path: Path, kind: str, bits: str | None, error: float) -> None:
    path = tmp_path / f"a.{kind}"
    writer = save(path, bits)
    sound, rate = soundfile.read(path, dtype="float32")
    assert rate == RATE and sound.shape == SOUND.shape
    assert np.max(np.abs(sound - SOUND)) <= error
    assert (writer.frames, writer.clipped) == (len(SOUND), 0)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(("kind", "bits", "_"), KINDS)
def test_same_sound_same_bytes(tmp_path: Path, kind: str, bits: str | None, _: float) -> None:
    first, second = tmp_path / f"a.{kind}", tmp_path / f"b.{kind}"
    save(first, bits)
    time.sleep(1.1 if bits in ("float", None) else 0)  # a timestamp by libsndfile would have whole seconds
    save(second, bits)
    assert first.read_bytes() == second.read_bytes()


@pytest.mark.parametrize("rate", [22050, 44100, 96000, 192000])
@pytest.mark.parametrize("kind", ["wav", "flac", "ogg"])
def test_rates(tmp_path: Path, kind: str, rate: int) -> None:
    save(tmp_path / f"a.{kind}", rate=rate)
    info = soundfile.info(str(tmp_path / f"a.{kind}"))
    assert (info.samplerate, info.frames) == (rate, len(SOUND))


@pytest.mark.parametrize("bits", ["16", "24"])
def test_integers_are_held_at_full_scale_and_counted(tmp_path: Path, bits: str) -> None:
    writer = save(tmp_path / "a.wav", bits, np.array([0.0, 1.5, -1.5, 1.0, -1.0, 40.0]))
    sound, _ = soundfile.read(tmp_path / "a.wav")
    np.testing.assert_allclose(sound, [0, 1, -1, 1, -1, 1], atol=1e-4)
    assert writer.clipped == 3
    assert save(tmp_path / "b.wav", "float", np.array([1.5])).clipped == 0


def test_stereo(tmp_path: Path) -> None:
    both = np.stack([SOUND, -SOUND], axis=1)
    with Transaction() as files:
        writer = AudioWriter(files, tmp_path / "a.wav", encoding(tmp_path / "a.wav", RATE, channels=2))
        writer.write(both)
        writer.close()
    assert soundfile.info(str(tmp_path / "a.wav")).channels == 2


@pytest.mark.parametrize(
    ("name", "requested", "says"),
    [
        ("a.mp3", {}, "its format must be wav, flac or ogg, not mp3"),
        ("a", {}, "its name tells no format; --format takes wav, flac or ogg"),
        ("a.wav", {"format": "flac"}, "is named as wav"),
        ("a.flac", {"bits": "float"}, "bits of flac must be 16 or 24, not float"),
        ("a.ogg", {"bits": "16"}, "bits: ogg has no choice of them, leave them out"),
        ("a.wav", {"bits": "8"}, "bits of wav must be 16, 24 or float, not 8"),
        ("a.flac", {"rate": 96001}, "whole tens"),
    ],
)
def test_encodings_that_do_not_exist(name: str, requested: dict[str, str | int], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        encoding(Path(name), **{"rate": RATE, **requested})  # type: ignore[arg-type]


def test_a_wav_file_ends_at_4_gigabytes() -> None:
    kind = encoding(Path("a.wav"), RATE, bits="float")
    kind.check_length(2**30 - 2000, Path("a.wav"))
    with pytest.raises(OutputError, match=r"holds up to 6\.21 hours; use --format flac"):
        kind.check_length(2**30, Path("a.wav"))
    encoding(Path("a.flac"), RATE).check_length(2**40, Path("a.flac"))


def test_places_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    for path, says in [
        (tmp_path, "is a directory"),
        (tmp_path / "none" / "a.wav", "there is no directory"),
        (tmp_path / "file" / "a.wav", "no directory"),
        (Path("/dev/full"), "not a regular file"),
        (CLOSED / "a.wav", "cannot be written"),
        (tmp_path / ("x" * 300 + ".wav"), "cannot be written"),
        (Path("a\0.wav"), "not a file name"),
    ]:
        with pytest.raises(OutputError, match=says) as error, Transaction() as files:
            files.create(path)
        assert "\n" not in str(error.value)
    with pytest.raises(OutputError, match="written twice"), Transaction() as files:
        files.create(tmp_path / "a.wav")
        files.create(tmp_path / "." / "a.wav")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize(("kind", "bits", "_"), KINDS)
def test_a_full_disk_leaves_nothing(tmp_path: Path, kind: str, bits: str | None, _: float) -> None:
    path = tmp_path / f"a.{kind}"
    path.write_text("before")
    with small_files(8192), pytest.raises(OutputError, match="cannot be written: File too large"):
        save(path, bits, np.random.default_rng(1).normal(0, 0.1, 200_000))
    assert [p.name for p in tmp_path.iterdir()] == [path.name] and path.read_text() == "before"


@pytest.mark.parametrize("error", [KeyboardInterrupt, SystemExit, ValueError])
def test_any_exception_leaves_nothing(tmp_path: Path, error: type[BaseException]) -> None:
    (tmp_path / "mix.wav").write_text("before")
    with pytest.raises(error), Transaction() as files:
        for name in ("stem.wav", "mix.wav"):
            writer = AudioWriter(files, tmp_path / name, encoding(tmp_path / name, RATE))
            writer.write(SOUND)
        raise error
    assert [p.name for p in tmp_path.iterdir()] == ["mix.wav"]
    assert (tmp_path / "mix.wav").read_text() == "before"


@pytest.mark.parametrize("failing", range(7))
def test_all_files_or_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: int) -> None:
    """Whichever renaming fails, the older files are restored. These four files need six renamings."""
    for name in ("1", "2"):
        (tmp_path / name).write_text("before")
    calls, replace = iter(range(100)), os.replace

    def sometimes(source: Path, target: Path) -> None:
        if next(calls) == failing:
            raise OSError(5, "Input/output error")
        replace(source, target)

    monkeypatch.setattr(os, "replace", sometimes)
    write = Transaction()
    try:
        with write as files:
            for name in "1234":
                files.write(tmp_path / name, b"after")
    except OutputError as error:
        assert failing < 6 and "Input/output error" in str(error)
    texts = {p.name: p.read_text() for p in tmp_path.iterdir()}
    assert texts == ({"1": "before", "2": "before"} if failing < 6 else dict.fromkeys("1234", "after"))


@pytest.mark.parametrize("number", STOPS)
def test_a_signal_waits_until_files_are_moved_or_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: signal.Signals
) -> None:
    """While files are moved, and while they are removed after another interrupt."""

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    replace, unlink = os.replace, Path.unlink

    def replace_(source: Path, target: Path) -> None:
        signal.raise_signal(number)
        replace(source, target)

    def unlink_(path: Path, missing_ok: bool = False) -> None:
        signal.raise_signal(number)
        unlink(path, missing_ok)

    before = signal.signal(number, stop)
    monkeypatch.setattr(os, "replace", replace_)
    monkeypatch.setattr(Path, "unlink", unlink_)
    try:
        with pytest.raises(KeyboardInterrupt), Transaction() as files:
            files.directory(tmp_path / "a")
            for name in "12":
                files.write(tmp_path / "a" / name, b"x")
        assert sorted(p.name for p in tmp_path.rglob("*")) == ["1", "2", "a"]
        with pytest.raises(KeyboardInterrupt), Transaction() as files:
            files.directory(tmp_path / "b" / "c")
            for name in "34":
                files.write(tmp_path / "b" / "c" / name, b"x")
            raise KeyboardInterrupt
        assert sorted(p.name for p in tmp_path.rglob("*")) == ["1", "2", "a"]
        assert signal.getsignal(number) is stop
    finally:
        signal.signal(number, before)


def test_a_single_file_that_cannot_be_moved_keeps_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise OSError(5, "Input/output error")

    (tmp_path / "1").write_text("before")
    monkeypatch.setattr(os, "replace", broken)
    with pytest.raises(OutputError, match="1: cannot be written: Input/output error"), Transaction() as files:
        files.write(tmp_path / "1", b"after")
    assert [p.name for p in tmp_path.iterdir()] == ["1"] and (tmp_path / "1").read_text() == "before"


def test_a_symbolic_link_stays(tmp_path: Path) -> None:
    (tmp_path / "real.wav").write_text("before")
    (tmp_path / "link.wav").symlink_to("real.wav")
    save(tmp_path / "link.wav")
    assert (tmp_path / "link.wav").is_symlink()
    assert soundfile.info(str(tmp_path / "real.wav")).frames == len(SOUND)


def test_file_limit_signal_is_ignored_by_python() -> None:
    """`small_files` depends on it: a write beyond the limit is an error, not the end of the process."""
    assert signal.getsignal(signal.SIGXFSZ) == signal.SIG_IGN


# --- reading ---

TONE = 0.5 * np.sin(np.arange(4800) / 20)
HALF_RATE = 24_000
FFMPEG = """import os, sys
arguments = sys.argv[1:]
open({log!r}, "w").write("\\n".join(arguments))
name = arguments[arguments.index("-i") + 1].removeprefix("file:")
if b"broken" in open(name, "rb").read():
    sys.exit("file:" + name + ": Invalid data found")
sys.stdout.buffer.write(open({wav!r}, "rb").read())
"""


def wav(rate: int = 48_000, subtype: str = "PCM_16", channels: int = 1) -> bytes:
    made = io.BytesIO()
    soundfile.write(made, np.stack([TONE] * channels, 1), rate, format="WAV", subtype=subtype)
    return made.getvalue()


def of_pipe(whole: bytes, riff: int, data: int, before: bytes = b"") -> bytes:
    """A WAV file with other sizes in its header, and chunks before the sound."""
    at = whole.index(b"data")
    head = whole[:4] + riff.to_bytes(4, "little") + whole[8:at]
    return head + before + b"data" + data.to_bytes(4, "little") + whole[at + 8 :]


def read(path: Path) -> Sound:
    return read_sound(path, "recording", 10.0, (8000, 192_000))


@pytest.mark.parametrize("before", [b"", b"LIST\x05\0\0\0abcde\0"])
@pytest.mark.parametrize(("riff", "data"), [(0, 0), (0xFFFFFFFF, 0xFFFFFFFF), (36, 0), (0, 0xFFFFFFFF)])
@pytest.mark.parametrize(("subtype", "channels"), [("PCM_16", 1), ("PCM_24", 2), ("FLOAT", 1)])
def test_a_wav_file_of_a_pipe_is_read(
    tmp_path: Path, riff: int, data: int, before: bytes, subtype: str, channels: int
) -> None:
    path = tmp_path / "pipe.wav"
    path.write_bytes(of_pipe(wav(subtype=subtype, channels=channels), riff, data, before))
    found = read(path)
    assert found.samples.shape == (len(TONE), channels) and np.abs(found.samples[:, 0] - TONE).max() < 1e-4


def test_a_wav_file_without_sound_is_left_as_it_is(tmp_path: Path) -> None:
    empty = wav()[: wav().index(b"data") + 4] + bytes(4)
    for k, end in enumerate((b"", b"LIST\x04\0\0\0abcd", b"LIST\x04\0\0\0abcdbext\x03\0\0\0abc\0")):
        (tmp_path / f"{k}.wav").write_bytes(empty + end)
        assert read(tmp_path / f"{k}.wav").samples.shape == (0, 1), k
    (tmp_path / "short.wav").write_bytes(b"RIFF\0\0\0\0WAVEfmt ")
    with pytest.raises(SoundError, match="a WAV file that cannot be read as sound"):
        read(tmp_path / "short.wav")


@pytest.mark.parametrize("format", sorted(set(soundfile.available_formats()) - {"RAW"}))
def test_what_libsndfile_writes_is_read(tmp_path: Path, format: str) -> None:
    path = tmp_path / "a.sound"
    subtype = soundfile.default_subtype(format) or next(iter(soundfile.available_subtypes(format)))
    rate = {"XI": 44_100, "OGG": 48_000}.get(format, 8000)
    soundfile.write(path, TONE, rate, format=format, subtype=subtype)
    assert len(read(path).samples) >= len(TONE) - 1


def write_program(path: Path, code: str) -> None:
    """Writes a program in Python. Its first line cannot name an interpreter in a folder with spaces."""
    path.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -c {shlex.quote(code)} "$@"\n')
    path.chmod(0o755)


@pytest.fixture
def ffmpeg(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A fake ffmpeg that logs its arguments, and writes a tone at HALF_RATE for any file except broken ones."""
    folder = tmp_path / "bin"
    folder.mkdir()
    log = folder / "arguments"
    (folder / "tone.wav").write_bytes(of_pipe(wav(HALF_RATE, "FLOAT", 2), 0xFFFFFFFF, 0xFFFFFFFF))
    write_program(folder / "ffmpeg", FFMPEG.format(log=str(log), wav=str(folder / "tone.wav")))
    monkeypatch.setenv("PATH", str(folder))
    return log


M4A = b"\0\0\0\x20ftypM4A \0\0\2\0" + bytes(99)


@pytest.mark.parametrize("name", ["a.m4a", "-y.m4a", "a b;$(c).m4a", "http:x.m4a"])
def test_other_kinds_are_read_through_ffmpeg(
    tmp_path: Path, ffmpeg: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path(name).write_bytes(M4A)
    before = sorted(tmp_path.rglob("*"))
    found = read(Path(name))
    assert found.rate == HALF_RATE and np.allclose(found.samples, np.stack([TONE, TONE], 1), atol=1e-6)
    arguments = ffmpeg.read_text().splitlines()
    assert arguments[arguments.index("-i") + 1] == f"file:{tmp_path / name}"
    assert arguments[arguments.index("-t") + 1] == "11" and "-nostdin" in arguments
    assert sorted(tmp_path.rglob("*")) == sorted([*before, ffmpeg]), "nothing is left behind"


def test_what_ffmpeg_cannot_read_is_one_line(tmp_path: Path, ffmpeg: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, data, says in (
        ("a.m4a", M4A + b"broken", "an M4A file: ffmpeg finds no sound in it (Invalid data found)"),
        ("a.bin", b"broken", "cannot be read as sound: not a sound file (Invalid data found)"),
        ("a.xml", b"<score-partwise>", "a MusicXML file, not a sound file; export it as MIDI"),
    ):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(SoundError) as caught:
            read(tmp_path / name)
        assert f"{tmp_path / name}: {says}" in str(caught.value) and "\n" not in str(caught.value)
    (tmp_path / "slow.m4a").write_bytes(M4A)
    write_program(ffmpeg.parent / "ffmpeg", "import time; time.sleep(60)")
    monkeypatch.setattr(audiofile, "FFMPEG_SECONDS", 0.1)
    with pytest.raises(SoundError, match=r"ffmpeg did not read it in 0.1 s; convert it to WAV"):
        read(tmp_path / "slow.m4a")


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (M4A, "an M4A file: install ffmpeg, through which livebass reads it, or convert it to WAV"),
        (b"\x1aE\xdf\xa3\x01webm" + bytes(99), "a WebM file: install ffmpeg, through which"),
        (b"noise", "cannot be read as sound: not a sound file, or one to convert to WAV first"),
        (b"fLaC" + bytes(99), "a FLAC file that cannot be read as sound: "),
        (b"\x18FICHIER GUITAR PRO v5.10", "a Guitar Pro 5 file, not a sound file; export it as MIDI"),
        (b"MThd\0\0\0\6", "a MIDI file, not a sound file; `livebass render` makes sound of it"),
        (b"%PDF-1.4", "a PDF file, not a sound file; a recording is a sound file"),
        (b"PK\3\4" + bytes(40), "a zip archive, not a sound file; unpack it first"),
        (b"! a.scl\n!\n", "a Scala scale, not a sound file; give it to --temperament"),
    ],
)
def test_a_file_of_another_kind_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, data: bytes, says: str
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    (tmp_path / "a.wav").write_bytes(data)
    with pytest.raises(SoundError) as caught:
        read(tmp_path / "a.wav")
    assert str(caught.value).startswith(f"{tmp_path / 'a.wav'}: {says}")
