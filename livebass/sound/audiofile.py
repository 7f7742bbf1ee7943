"""Writes WAV, FLAC and Ogg Vorbis files block by block; the same sound gives the same bytes. Reads sound files.

If ffmpeg is installed, it reads formats unknown to libsndfile.
"""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import stat
import subprocess
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
import soundfile
from numpy.typing import NDArray

from livebass.files.kinds import ARCHIVES, HEAD, SCORES, SOUNDS, kind_of
from livebass.files.whole import OutputError, Transaction, output_error
from livebass.rows.bounds import between, either, refusal

# format -> bits -> libsndfile's name; None: the format's default
SUBTYPES: dict[str, dict[str | None, str]] = {
    "wav": {None: "PCM_24", "16": "PCM_16", "24": "PCM_24", "float": "FLOAT"},
    "flac": {None: "PCM_24", "16": "PCM_16", "24": "PCM_24"},
    "ogg": {None: "VORBIS"},
}
BYTES = {"PCM_16": 2, "PCM_24": 3, "FLOAT": 4}
WAV_LIMIT = (1 << 32) - 4096  # bytes: WAV counts them in 32 bits
CHUNK = 1 << 15  # frames written at once; the Vorbis encoder keeps a chunk on its stack
OGG_SERIAL = b"bass"
# Kinds that libsndfile reads if undamaged
READABLE = {
    f"{kind} file" for kind in ("a WAV", "an AIFF", "a FLAC", "an Ogg Vorbis", "an Opus", "an MP3", "a CAF", "an AU")
}
UNKNOWN = (0, 0xFFFFFFFF)  # sizes in the header of a WAV file written to a pipe
FFMPEG, FFMPEG_SECONDS = "ffmpeg", 120.0  # and its time limit


class SoundError(ValueError):
    """A sound file cannot be read. Message: one line, name and reason."""


@dataclass(frozen=True, eq=False)
class Sound:
    """The content of a sound file."""

    samples: NDArray[np.float64]  # (n, channels), full scale 1
    rate: int  # Hz


def read_sound(path: str | os.PathLike[str], what: str, longest: float, rates: tuple[int, int]) -> Sound:
    """Reads a sound file of at most `longest` s whose rate (Hz) lies between `rates`.

    what: "recording" or the like, for messages. Raises SoundError.
    """
    name = os.fspath(path)
    try:
        found = os.stat(name).st_mode
        if not stat.S_ISREG(found):
            form = "a directory" if stat.S_ISDIR(found) else "not a regular file"
            raise SoundError(f"{name}: is {form}; a {what} is a sound file")
        with open(name, "rb") as file:
            kind = kind_of(file.read(HEAD))
            _refuse(name, kind, what)
            try:
                return _decode(name, _mend_header(file) or sound_name(name), what, longest, rates)
            except soundfile.LibsndfileError as error:
                reason = error.error_string.rstrip(".")
        made = io.BytesIO(_by_ffmpeg(name, kind, reason, longest))
        return _decode(name, _mend_header(made) or made, what, longest, rates)
    except SoundError:
        raise
    except FileNotFoundError:
        raise SoundError(f"{name}: no such file") from None
    except soundfile.LibsndfileError as error:
        raise SoundError(f"{name}: cannot be read as sound: {error.error_string}") from None
    except OSError as error:
        raise SoundError(f"{name}: cannot be read: {error.strerror or error}") from None
    except ValueError:  # zero byte in the name
        raise SoundError(f"{name!r}: not a file name") from None


def _refuse(name: str, kind: str | None, what: str) -> None:
    """Raises SoundError for a file whose first bytes show that it holds no sound."""
    if kind is None or kind in SOUNDS:
        return
    advice = f"a {what} is a sound file"
    if kind == "a MIDI file":
        advice = "`livebass render` makes sound of it"
    elif kind in SCORES:
        advice = "export it as MIDI and give that to `livebass render`"
    elif kind in ARCHIVES:
        advice = "unpack it first"
    elif kind == "a Scala scale":
        advice = "give it to --temperament"
    raise SoundError(f"{name}: {kind}, not a sound file; {advice}")


def _decode(name: str, source: str | bytes | BinaryIO, what: str, longest: float, rates: tuple[int, int]) -> Sound:
    """Decodes a `source` that libsndfile can read: a file's name or its content."""
    if not isinstance(source, str | bytes):
        source.seek(0)
    with soundfile.SoundFile(source) as sound:
        rate = sound.samplerate
        if not rates[0] <= rate <= rates[1]:
            raise SoundError(f"{name}: its rate must be {between(*rates, 'Hz')}, not {rate} Hz")
        if sound.frames > longest * rate:
            raise SoundError(f"{name}: lasts {sound.frames / rate:.4g} s; a {what} lasts {longest:g} s at most")
        return Sound(sound.read(sound.frames, dtype="float64", always_2d=True), rate)


def _mend_header(file: BinaryIO) -> BinaryIO | None:
    """Returns a WAV file with the sizes that its header lacks; None for any other file.

    The sound then goes to the end of the file.
    """
    end = file.seek(0, os.SEEK_END)
    file.seek(0)
    head = file.read(12)
    if head[:4] != b"RIFF" or head[8:] != b"WAVE":
        return None
    at = 12
    while at + 8 <= end:
        file.seek(at)
        name, size = file.read(4), int.from_bytes(file.read(4), "little")
        at += 8
        if name == b"data":
            break
        at += size + size % 2
    else:
        return None
    if size not in UNKNOWN or at == end or (size == 0 and _are_chunks(file, at, end)):
        return None
    file.seek(0)
    whole = bytearray(file.read())
    whole[4:8] = min(end - 8, 0xFFFFFFFE).to_bytes(4, "little")
    whole[at - 4 : at] = min(end - at, 0xFFFFFFFE).to_bytes(4, "little")
    return io.BytesIO(whole)


def _are_chunks(file: BinaryIO, at: int, end: int) -> bool:
    """True if a RIFF file consists of chunks from byte `at` to its `end`."""
    while at + 8 <= end:
        file.seek(at)
        name, size = file.read(4), int.from_bytes(file.read(4), "little")
        if not name.isascii() or not name.decode("ascii").isprintable():
            return False
        at += 8 + size + size % 2
    return end <= at <= end + 1


def _by_ffmpeg(name: str, kind: str | None, reason: str, longest: float) -> bytes:
    """Runs ffmpeg: returns a file's first sound as 32-bit float WAV, cut a little beyond `longest` s.

    reason: why libsndfile cannot read it. Raises SoundError.
    """
    program = shutil.which(FFMPEG)
    if program is None:
        if kind is None:
            raise SoundError(f"{name}: cannot be read as sound: not a sound file, or one to convert to WAV first")
        if kind in READABLE:
            raise SoundError(f"{name}: {kind} that cannot be read as sound: {reason}; convert it to WAV")
        raise SoundError(f"{name}: {kind}: install ffmpeg, through which livebass reads it, or convert it to WAV")
    command = [
        program, "-nostdin", "-hide_banner", "-loglevel", "error",
        "-protocol_whitelist", "file,pipe",  # a playlist opens nothing else
        "-i", f"file:{os.path.abspath(name)}", "-map", "0:a:0", "-t", f"{longest + 1:g}",
        "-c:a", "pcm_f32le", "-f", "wav", "pipe:1",
    ]  # fmt: skip
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, timeout=FFMPEG_SECONDS)
    except subprocess.TimeoutExpired:
        raise SoundError(f"{name}: ffmpeg did not read it in {FFMPEG_SECONDS:g} s; convert it to WAV") from None
    except OSError as error:
        raise SoundError(f"{name}: ffmpeg cannot be run: {error.strerror or error}; convert it to WAV") from None
    if done.returncode or not done.stdout:
        said = done.stderr.decode(errors="replace").strip().splitlines()
        why = said[-1].replace(f"file:{os.path.abspath(name)}: ", "") if said else reason
        what = f"{kind}: ffmpeg finds no sound in it" if kind else "cannot be read as sound: not a sound file"
        raise SoundError(f"{name}: {what} ({why})")
    return done.stdout


@dataclass(frozen=True)
class Encoding:
    """A valid combination of format, sample type, rate and channels; made by `encoding`."""

    format: str  # "wav", "flac" or "ogg"
    subtype: str  # libsndfile's name
    rate: int  # Hz
    channels: int = 1

    def check_length(self, frames: int, path: Path) -> None:
        """Raises OutputError if a file cannot hold `frames` frames."""
        limit = WAV_LIMIT // (BYTES.get(self.subtype, 1) * self.channels)
        if self.format == "wav" and frames > limit:
            hours = limit / self.rate / 3600
            raise OutputError(f"{path}: a wav file of this kind holds up to {hours:.3g} hours; use --format flac")


def encoding(path: Path, rate: int, format: str | None = None, bits: str | None = None, channels: int = 1) -> Encoding:
    """Returns the encoding for `path`; `format` defaults to its extension. Raises ValueError: says what is allowed."""
    named = path.suffix.lower().removeprefix(".")
    kind = format or named
    if kind not in SUBTYPES:
        if not kind:
            raise ValueError(f"{path}: its name tells no format; --format takes {either(SUBTYPES)}")
        raise ValueError(f"{path}: its format must be {either(SUBTYPES)}, not {kind} (--format)")
    if named in SUBTYPES and named != kind:
        raise ValueError(f"{path}: is named as {named}, but the format is {kind}")
    if bits not in SUBTYPES[kind]:
        if not any(SUBTYPES[kind]):
            raise ValueError(f"bits: {kind} has no choice of them, leave them out")
        raise refusal(f"bits of {kind}", either(b for b in SUBTYPES[kind] if b), bits)
    if kind == "flac" and rate > 65535 and rate % 10:
        raise ValueError(f"rate {rate} Hz: flac allows whole tens above 65535 Hz")
    return Encoding(kind, SUBTYPES[kind][bits], rate, channels)


def sound_name(path: str | os.PathLike[str]) -> str | bytes:
    """The name by which soundfile opens `path`: bytes on systems whose file names are bytes, perhaps not UTF-8."""
    return os.fsencode(path) if os.name == "posix" else os.fspath(path)


class AudioWriter:
    """Writes one sound file of a transaction. Call `close` before the transaction ends.

    ``with Transaction() as files: writer = AudioWriter(files, path, encoding(path, rate))``
    """

    def __init__(self, files: Transaction, path: Path, encoding: Encoding) -> None:
        self.path, self.encoding = path, encoding
        self.frames = 0  # written
        self.clipped = 0  # samples beyond full scale; integer formats clip them
        self._size = 0  # bytes, after the last successful write
        self._fd, self._temporary = files.create(path)
        try:
            self._sound = soundfile.SoundFile(
                self._fd, "w", encoding.rate, encoding.channels, encoding.subtype,
                format=encoding.format.upper(), closefd=False,
            )  # fmt: skip
        except soundfile.LibsndfileError as error:
            raise self._reason(error) from None
        files.before_closing(self._abandon)

    def write(self, sound: NDArray[np.float32] | NDArray[np.float64]) -> None:
        """Appends `sound`, (frames,) or (frames, channels), full scale 1. Raises OutputError."""
        if self.encoding.subtype != "FLOAT":
            self.clipped += int(np.count_nonzero(np.abs(sound) > 1.0))
        self.frames += len(sound)
        self.encoding.check_length(self.frames, self.path)
        try:
            for start in range(0, len(sound), CHUNK):
                self._sound.write(np.ascontiguousarray(sound[start : start + CHUNK]))
            self._size = os.fstat(self._fd).st_size
        except (soundfile.LibsndfileError, AssertionError) as error:  # AssertionError: soundfile wrote fewer frames
            raise self._reason(error) from None

    def close(self) -> None:
        """Finishes the file and checks its length. Raises OutputError."""
        try:
            self._sound.close()
            if soundfile.info(sound_name(self._temporary)).frames != self.frames:
                raise self._reason(OSError("the file is too short"))
            self._make_repeatable()
        except soundfile.LibsndfileError as error:
            raise self._reason(error) from None
        except OutputError:
            raise
        except OSError as error:
            raise output_error(self.path, error) from None

    def close_short(self) -> int:
        """Finishes a file after `write` or `close` failed; returns its number of frames, 0 if unreadable."""
        try:
            os.ftruncate(self._fd, self._size)
            os.lseek(self._fd, 0, os.SEEK_END)
            self._abandon()
            frames = _readable_frames(self._temporary)
            if self.encoding.format == "flac":
                self._set_flac_frames(frames)
        except (OSError, soundfile.LibsndfileError):
            return 0
        return frames

    def _set_flac_frames(self, frames: int) -> None:
        """Sets the number of samples, 36 bits of the STREAMINFO block. The encoder fills it in at the end."""
        word = int.from_bytes(_read_at(self._fd, 18, 8))
        _write_at(self._fd, 18, (word & ~((1 << 36) - 1) | frames).to_bytes(8))

    def _abandon(self) -> None:
        """Closes the encoder and ignores its errors; no effect after `close`."""
        with contextlib.suppress(soundfile.LibsndfileError):
            self._sound.close()

    def _reason(self, error: Exception) -> OutputError:
        """Returns why the encoder failed. It does not say, so write some more and ask the system."""
        try:
            os.lseek(self._fd, 0, os.SEEK_END)
            os.write(self._fd, bytes(1 << 16))
            os.fsync(self._fd)
        except OSError as reason:
            return output_error(self.path, reason)
        return OutputError(f"{self.path}: cannot be written: {error or 'the encoder failed'}")

    def _make_repeatable(self) -> None:
        """Removes what libsndfile derives from the clock: a time in float WAV, a serial number in Ogg."""
        if self.encoding.subtype == "FLOAT":
            head = _read_at(self._fd, 0, 512)
            peak = head.find(b"PEAK")
            if peak >= 0:
                _write_at(self._fd, peak + 12, bytes(4))
        elif self.encoding.format == "ogg":
            with os.fdopen(os.dup(self._fd), "r+b") as file:
                file.seek(0)
                pages = with_ogg_serial(file.read(), OGG_SERIAL)
                file.seek(0)
                file.write(pages)


def _readable_frames(path: Path) -> int:
    """Returns the number of frames up to the first broken one."""
    frames = 0
    with soundfile.SoundFile(sound_name(path)) as file, contextlib.suppress(soundfile.LibsndfileError):
        while count := len(file.read(1024)):
            frames += count
    return frames


def _read_at(fd: int, offset: int, size: int) -> bytes:
    os.lseek(fd, offset, os.SEEK_SET)
    return os.read(fd, size)


def _write_at(fd: int, offset: int, data: bytes) -> None:
    os.lseek(fd, offset, os.SEEK_SET)
    os.write(fd, data)


_REVERSED = bytes(int(f"{i:08b}"[::-1], 2) for i in range(256))


def with_ogg_serial(stream: bytes, serial: bytes) -> bytes:
    """Returns an Ogg stream with a new 4-byte serial number in every page, and new checksums."""
    out = bytearray(stream)
    at = 0
    while out[at : at + 4] == b"OggS":
        segments = out[at + 26]
        end = at + 27 + segments + sum(out[at + 27 : at + 27 + segments])
        out[at + 14 : at + 18] = serial
        out[at + 22 : at + 26] = bytes(4)
        out[at + 22 : at + 26] = _ogg_crc(bytes(out[at:end])).to_bytes(4, "little")
        at = end
    return bytes(out)


def _ogg_crc(page: bytes) -> int:
    """CRC-32 with polynomial 0x04C11DB7, most significant bit first, from 0: zlib's with all bits reversed."""
    mirrored = zlib.crc32(page.translate(_REVERSED), 0xFFFFFFFF) ^ 0xFFFFFFFF
    return int(f"{mirrored:032b}"[::-1], 2)
