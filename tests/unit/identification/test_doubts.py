"""Doubts of `livebass identify`: it reports and leaves out clipping, other notes and partials of no string."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import Run, cli_text, refusal
from support.costs import quick, slow
from support.own_basses import load_preset
from support.places import RECORDINGS
from support.ringing import RATE, pluck
from support.strings import FREQUENCIES, g_neck, g_string, paper_g

from livebass.lab.identification.doubts import clipped_tops, doubtful
from livebass.lab.identification.fit import fit_laws
from livebass.lab.identification.identify import identify
from livebass.lab.identification.lines import Line
from livebass.lab.identification.partials import Found
from livebass.lab.identification.result import Identified
from livebass.model import modes
from livebass.model.instrument import Speaking, speaking
from livebass.preset.load import laboratory_names, preset_names

LAW_ONLY = replace(g_string(), measured_frequencies=(), measured_dampings=())
note = partial(pluck, seconds=3.0, count=40)


def sine(nu: float, sigma: float, level: float, seconds: float = 3.0) -> np.ndarray:
    t = np.arange(round(seconds * RATE)) / RATE
    return level * np.exp(-sigma * t) * np.sin(2 * np.pi * nu * t)


def save(path: Path, sound: np.ndarray, subtype: str = "PCM_24", clip: float = 1.0) -> Path:
    """Writes `sound` after a quarter of a second of silence, with noise at -80 dB of full scale, clipped at `clip`."""
    noise = np.random.default_rng(1).normal(scale=1e-4, size=sound.size + RATE // 4)
    noise[RATE // 4 :] += sound
    soundfile.write(path, np.clip(noise, -clip, clip), RATE, subtype=subtype)
    return path


def listen(path: Path, modes: int = 20, preset: str = "paper-g") -> Identified:
    return identify([path], load_preset(preset), modes=modes)


def open_string(preset: str, name: str) -> Speaking:
    bass = load_preset(preset)
    index = bass.string_index(name)
    return speaking(bass.strings[index], bass.necks[index], 0)


@pytest.mark.parametrize("subtype", quick(["PCM_16", "FLOAT"], ["PCM_16"]))
def test_a_clipped_beginning_is_left_out(tmp_path: Path, subtype: str) -> None:
    sound = 4 * note(paper_g())
    late = int(np.flatnonzero(np.abs(sound) > 0.9)[-1]) / RATE
    result = listen(save(tmp_path / "g.wav", sound, subtype, 0.9))
    assert (
        len(result.doubts) == 1 and "clips for" in result.doubts[0] and "g.wav: the note at 0.27 s" in result.doubts[0]
    )
    assert result.takes[0].start_s == pytest.approx(0.25 + late, abs=0.02)
    np.testing.assert_allclose([p.frequency for p in result.partials], FREQUENCIES[:20], rtol=1e-4)


def test_a_note_that_clips_to_its_end_is_refused(run: Run, tmp_path: Path) -> None:
    save(tmp_path / "g.wav", 40 * note(paper_g(), seconds=1.0), clip=0.5)
    assert "clips for" in refusal(run, "identify", tmp_path / "g.wav", "-o", tmp_path / "mine.toml", status=1)
    assert not (tmp_path / "mine.toml").exists()


@pytest.mark.parametrize("bits", [8, 12, 16, 24])
@pytest.mark.parametrize("level", [0.01, 0.3, 1.0])
def test_round_tops_are_not_clipping(bits: int, level: float) -> None:
    """Whatever their height in file steps, for a steady sine and for a string."""
    steps = 2.0 ** (bits - 1)
    low = sine(41.2, 0.0, 1.0, 1.0)
    for sound in (low, low + 0.06 * sine(123.6, 0.0, 1.0, 1.0), note(paper_g(), seconds=1.0)):
        assert clipped_tops(np.round(level * sound / np.abs(sound).max() * steps) / steps).size == 0
    if level * steps > 100:
        assert clipped_tops(np.round(level * np.clip(low, -0.7, 0.7) * steps) / steps).size > 80


@pytest.mark.parametrize("given", [slow(()), ("--string", "G")])
def test_another_note_after_it(run: Run, tmp_path: Path, given: tuple[str, ...]) -> None:
    save(tmp_path / "two.wav", np.concatenate([note(paper_g()), note(open_string("jazz-finger", "D"))]))
    figures = tmp_path / "two.json"
    out = cli_text(run, "identify", tmp_path / "two.wav", "--modes", 12, "--json", figures, *given)
    doubts = json.loads(figures.read_text())["doubts"]
    assert len(doubts) == 1 and f"doubt: {doubts[0]}\n" in out
    assert "two.wav: the note at 3.2" in doubts[0] and "is another note, D2 (73." in doubts[0]


def test_noise_after_it(tmp_path: Path) -> None:
    noise = np.random.default_rng(2).normal(scale=0.05, size=RATE)
    quiet = note(paper_g()) * np.exp(-np.arange(3 * RATE) / RATE)
    (doubt,) = listen(save(tmp_path / "g.wav", np.concatenate([quiet, np.zeros(RATE // 2), noise]))).doubts
    assert doubt.endswith("has no clear pitch: left out")


@pytest.mark.slow
@pytest.mark.parametrize("other", ["A", "D"])
def test_two_notes_at_once(run: Run, tmp_path: Path, other: str) -> None:
    """Both notes are refused; beside a take of the string alone only the two are left out."""
    both = note(paper_g()) + 0.7 * note(open_string("jazz-finger", other))
    save(tmp_path / "both.wav", both)
    save(tmp_path / "alone.wav", note(paper_g()))
    bass = load_preset("jazz-finger")
    with pytest.raises(ValueError, match=f"another note, {other}.* sounds alone"):
        identify([tmp_path / "both.wav"], bass, string="G", modes=20)
    result = identify([tmp_path / "alone.wav", tmp_path / "both.wav"], bass, string="G", modes=20)
    assert len(result.takes) == 1 and result.rejected == 1
    assert [f"has another note, {other}" in doubt for doubt in result.doubts] == [True]
    np.testing.assert_allclose([p.frequency for p in result.partials], FREQUENCIES[:20], rtol=1e-5)


def test_hum_and_strays_in_place_of_partials(run: Run, tmp_path: Path) -> None:
    """A string plucked at a fifth has no partials 5, 10, 15: sounds near them stay out of the preset."""
    s = speaking(LAW_ONLY, g_neck(), 0)
    nu = modes.frequencies(s, 20)
    strays = sine(nu[4] + 2, 0.03, 0.01) + sine(nu[9] + 12, 1.0, 0.01) + sine(nu[14], 60.0, 0.1)
    save(tmp_path / "g.wav", note(s, at=s.length / 5) + strays)
    out = cli_text(run, "identify", tmp_path / "g.wav", "-p", "paper-g", "--modes", 18, "-o", tmp_path / "mine.toml")
    doubts = [line for line in out.splitlines() if line.startswith("doubt: ")]
    for line, begins in zip(doubts, ("off the law: 10 (", "ringing longer", "dying faster"), strict=True):
        assert line.startswith(f"doubt: partials {begins}"), doubts
    assert "not measured: 5, 10, 15; the preset takes them from the laws" in out
    made = load_preset(str(tmp_path / "mine.toml")).strings[0]
    np.testing.assert_allclose(made.measured_frequencies, nu[:18], rtol=1e-4)
    np.testing.assert_allclose(made.measured_dampings, modes.dampings(s, 18), rtol=0.2)


@pytest.mark.parametrize("preset", [*preset_names(), *laboratory_names()])
def test_no_doubt_about_the_partials_of_a_preset(preset: str) -> None:
    bass = load_preset(preset)
    for string, neck in zip(bass.strings, bass.necks, strict=True):
        s, j = speaking(string, neck, 0), np.arange(1, 61)
        nu, sigma = modes.frequencies(s, 60), modes.dampings(s, 60)
        found = [Found(int(k), f, d, 0.0, 0.0, 0.0, 1, Line(f, d, 1.0)) for k, f, d in zip(j, nu, sigma, strict=True)]
        for count in (8, 20, 60):
            law = fit_laws(j[:count], nu[:count], string)[0]
            assert doubtful(found[:count], string, law) == (set(), []), (string.name, count)


@pytest.mark.parametrize(
    ("preset", "string"),
    [
        ("jazz-finger", "E"),
        ("muted", "G"),
        *(slow(name, "") for name in preset_names()),
    ],
)
def test_no_doubt_about_a_clean_note(tmp_path: Path, preset: str, string: str) -> None:
    """On one string of a preset, or on all of them."""
    bass = load_preset(preset)
    for name in [string] if string else [s.name for s in bass.strings]:
        path = save(tmp_path / "note.wav", note(open_string(preset, name)))
        assert identify([path], bass, string=name, modes=20, only_string=True).doubts == ()


@pytest.mark.slow
def test_recordings_of_a_real_bass() -> None:
    """The G has a line of -61 dB, 13 Hz below its partial 37, whose neighbours have -42 dB; the E one of -44 dB."""
    folder, bass = RECORDINGS, load_preset("jazz-finger")
    for name, stray in (("e", "23 (979."), ("g", "37 (369")):
        (doubt,) = identify(folder / f"picked-{name}.flac", bass, only_string=True).doubts
        assert doubt.startswith(f"partials off the law: {stray}")
