"""The sounds of README and the site, docs/sounds/*.ogg, are what livebass renders today, and as their texts say."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from numpy.typing import NDArray
from support.programs import load

from livebass import load_preset, loudness, quality_with
from livebass.engine.engine import Engine

TOOL = load("sounds")
FOLDER, RATE, SECONDS = TOOL.TABLE.parent, TOOL.RATE, TOOL.SECONDS
SOUNDS: dict[str, dict[str, Any]] = {Path(sound["file"]).stem: sound for sound in TOOL.sounds()}
MAX_BYTES = 400_000  # of all files together
MIN_SNR = 26.0  # dB; the codec alone leaves 28 or more, another processor 120
MAX_OFF = 0.3  # dB in an octave from 31 Hz; the codec changes none by more than 0.15


def octaves(sound: NDArray[np.float64]) -> NDArray[np.float64]:
    """The level (dB) of nine octaves from 31.25 Hz."""
    power = np.abs(np.fft.rfft(sound)) ** 2
    octave = np.floor(np.log2(np.fft.rfftfreq(len(sound), 1 / RATE)[1:] / 31.25))
    return np.array([10 * np.log10(power[1:][octave == k].sum()) for k in range(9)])


def difference(file: NDArray[np.float64], rendered: NDArray[np.float64]) -> list[str]:
    """What of a decoded file differs from a render; empty if only by what the codec loses."""
    snr = 10 * np.log10(np.mean(rendered**2) / np.mean((file - rendered) ** 2))
    off = np.abs(octaves(file) - octaves(rendered)).max()
    found = [f"SNR {snr:.1f} dB"] if snr < MIN_SNR else []
    return [*found, f"an octave is {off:.2f} dB off"] if off > MAX_OFF else found


def decode(name: str) -> NDArray[np.float64]:
    sound, rate = soundfile.read(FOLDER / SOUNDS[name]["file"])
    assert rate == RATE and sound.shape == (round(SECONDS * RATE),), "mono"
    return np.asarray(sound)


@pytest.mark.parametrize("name", SOUNDS)
def test_a_file_is_what_livebass_renders(name: str) -> None:
    assert not difference(decode(name), TOOL.rendered(SOUNDS[name])), "changed on purpose? run tools/sounds.py"


@pytest.mark.parametrize(
    "changed",
    [
        {"preset": "five-string"},
        pytest.param({"tempo": 100.01}, marks=pytest.mark.slow),
        pytest.param({"notes": SOUNDS["soft-and-hard"]["notes"][:-1]}, marks=pytest.mark.slow),
    ],
    ids=lambda changed: next(iter(changed)),
)
def test_another_preset_tempo_or_score_is_noticed(changed: dict[str, Any]) -> None:
    """Even a bass that differs little: jazz-finger with a low B."""
    assert difference(decode("soft-and-hard"), TOOL.rendered(SOUNDS["soft-and-hard"] | changed, "live"))


@pytest.mark.parametrize("name", SOUNDS)
def test_a_file_is_as_loud_as_the_others_and_begins_and_ends_without_a_click(name: str) -> None:
    sound = decode(name)
    assert loudness(sound, RATE) == pytest.approx(TOOL.LOUDNESS, abs=0.1)
    assert np.abs(sound).max() < 0.8
    edge = np.abs(sound[: round(0.01 * RATE)]).max(), np.abs(sound[-round(0.002 * RATE) :]).max()
    assert max(edge) < 0.003, edge
    heard = np.flatnonzero(np.abs(sound) > 0.01) / RATE
    assert heard[0] < 0.02 and SECONDS - heard[-1] < 0.15 and np.diff(heard).max() < 0.15, "a silence"


def test_the_table_names_the_files_and_they_are_small() -> None:
    files = sorted(FOLDER.glob("*.ogg"))
    assert files == sorted(FOLDER / sound["file"] for sound in SOUNDS.values())
    assert list(SOUNDS) == ["soft-and-hard", "fingers", "slap", "pick"], "the order in which they play"
    assert sum(file.stat().st_size for file in files) <= MAX_BYTES
    for sound in SOUNDS.values():
        assert sound["text"].endswith(".") and sound["title"] and not sound["title"].endswith(".")


class Counting(Engine):
    """An engine that counts contacts."""

    contacts = 1


def test_soft_notes_touch_no_fret_and_hard_ones_do() -> None:
    """As the text of the first sound says."""
    row = SOUNDS["soft-and-hard"]
    half = len(row["notes"]) // 2
    soft, hard = row["notes"][:half], row["notes"][half:]
    assert [note[2] for note in soft] == [note[2] for note in hard], "the same bar twice"
    contacts = []
    for notes in (soft, hard):
        engine = Counting(load_preset(row["preset"]), quality_with("live"), RATE)
        for _ in engine.play(TOOL.score(row | {"notes": notes}), 0.0):
            pass
        contacts.append([int(voice.record[0]["logged"]) for voice in engine.voices])
    assert contacts[0] == [0, 0, 0, 0] and min(contacts[1]) > 10, contacts


@pytest.mark.skipif(soundfile.__version__ < "0.13", reason="soundfile before 0.13 has no compression_level")
def test_the_tool_encodes_a_sound_the_same_way_twice() -> None:
    sound = np.sin(np.arange(RATE) / 50) / 2
    made = [TOOL.encoded(sound) for _ in range(2)]
    assert made[0] == made[1]
    back, rate = soundfile.read(io.BytesIO(made[0]))
    assert rate == RATE and np.abs(back - sound).max() < 0.05
