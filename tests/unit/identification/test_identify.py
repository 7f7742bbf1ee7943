"""`livebass identify` and the functions behind it, on notes with known modes and on a real bass."""

from __future__ import annotations

import csv
import json
import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import soundfile
from support.command import Run, cli_text, refusal
from support.costs import quick
from support.own_basses import load_preset
from support.places import RECORDINGS
from support.ringing import RATE, pluck, ring, uneven
from support.strings import DAMPINGS, FREQUENCIES, g_neck, g_string, paper_g

from livebass.lab.identification.esprit import SAMPLES, band, components
from livebass.lab.identification.fit import fit_law, fit_laws, fit_losses
from livebass.lab.identification.identify import identify
from livebass.lab.identification.partials import find_takes, read_recording, track
from livebass.lab.identification.result import Identified
from livebass.model import modes
from livebass.model.instrument import STIFFNESS_LAWS, Speaking, speaking
from livebass.model.neck import neck_damping
from livebass.preset.load import preset_source
from livebass.rows.units import cents

# A recording, its string, its pitch, its inharmonicity, and the least number of partials found
REAL = (
    ("picked-g.flac", "G", 98.0, (3.2e-5, 3.7e-5), 50), ("picked-e.flac", "E", 41.2, (1.1e-4, 1.6e-4), 45),
)  # fmt: skip
LAW_ONLY = replace(g_string(), measured_frequencies=(), measured_dampings=())


def noisy(sound: np.ndarray, ratio_db: float, seed: int = 1, lead: int = RATE // 4) -> np.ndarray:
    """Adds white noise `ratio_db` below the sound's power; it begins `lead` samples before the sound."""
    noise = np.random.default_rng(seed).normal(size=sound.size + lead)
    noise *= math.sqrt(float(np.mean(sound**2))) * 10 ** (-ratio_db / 20)
    noise[lead:] += sound
    return noise


def save(path: Path, sound: np.ndarray, rate: int = RATE, subtype: str = "FLOAT") -> Path:
    soundfile.write(path, sound, rate, subtype=subtype)
    return path


def errors(result: Identified, s: Speaking | None = None) -> tuple[dict[int, float], dict[int, float]]:
    """Returns relative errors of frequencies and dampings by partial number."""
    s = s or paper_g()
    nu, sigma = modes.frequencies(s, 200), modes.dampings(s, 200)
    return (
        {p.number: abs(p.frequency / nu[p.number - 1] - 1) for p in result.partials},
        {p.number: abs(p.damping / sigma[p.number - 1] - 1) for p in result.partials},
    )


@pytest.mark.parametrize(
    ("at", "ratio_db", "count", "frequency", "damping"),
    quick(
        [  # the note, its noise, the least number of partials, and the accuracy of the first 30 (or all) of them
            (0.02, 60, 78, 1e-6, 0.2e-2),  # required: 5e-4 and 5e-2
            (0.02, 40, 65, 5e-6, 1e-2),
            (0.02, 20, 36, 5e-5, 8e-2),
            (0.64, 60, 70, 2e-5, 2e-2),  # the usual plucking place: the high partials are weak, 27 is near a node
            (0.64, 40, 52, 2e-4, 10e-2),
            (0.64, 20, 28, 2e-4, 30e-2),
        ],
        always=[(0.64, 20, 28, 2e-4, 30e-2)],
    ),
)
def test_modes_of_the_measured_string(
    tmp_path: Path, at: float, ratio_db: float, count: int, frequency: float, damping: float
) -> None:
    path = save(tmp_path / "g.wav", noisy(pluck(at=at), ratio_db))
    result = identify([path], load_preset("jazz-finger"), modes=80)
    off_frequency, off_damping = errors(result)
    numbers = [j for j in sorted(off_frequency) if j <= 30]
    assert len(result.partials) >= count and len(numbers) >= 27, (len(result.partials), len(numbers))
    worst = max(off_frequency[j] for j in numbers), max(off_damping[j] for j in numbers)
    assert worst[0] <= frequency and worst[1] <= damping, worst
    assert result.string.name == "G"


@pytest.mark.slow
def test_the_uncertainty_of_one_take_is_that_of_its_noise() -> None:
    """About 95 % of the 95 % intervals contain the true value."""
    sound, s = pluck(seconds=3.0), paper_g()
    nu, sigma = modes.frequencies(s, 40), modes.dampings(s, 40)
    off = []
    for seed in range(3):
        for p in track(noisy(sound, 40, seed, lead=0), RATE, 98.0, 40):
            off += [(p.frequency - nu[p.number - 1]) / p.frequency_sd, (p.damping - sigma[p.number - 1]) / p.damping_sd]
    assert 0.8 < np.sqrt(np.mean(np.square(off))) < 1.6
    assert np.mean(np.abs(off) < 1.96) > 0.8


@pytest.mark.parametrize("damping", [0.1, 1.0, 10.0, 100.0])
def test_dampings_from_a_tenth_to_a_hundred(damping: float) -> None:
    nu = 98.0 * np.arange(1, 13)
    sound = noisy(ring(np.ones(12), nu, np.full(12, damping), 3.0), 60, lead=0)
    found = track(sound, RATE, 97.0, 12)
    assert [p.number for p in found] == list(range(1, 13))
    np.testing.assert_allclose([p.frequency for p in found], nu, rtol=5e-4)
    np.testing.assert_allclose([p.damping for p in found], damping, rtol=0.05)
    np.testing.assert_allclose([p.amplitude for p in found], 1, rtol=0.1)


def test_a_band_by_itself() -> None:
    """Without noise, the sines of a band are exact except for rounding and the filter's leakage."""
    sound = ring([1.0, 0.3], [440.0, 447.0], [2.0, 5.0], 1.0)
    cut, silent = band(sound, RATE, 441.0, 150.0), band(np.zeros(RATE), RATE, 441.0, 150.0)
    assert cut is not None and len(cut.samples) <= SAMPLES
    seen = components(cut)
    np.testing.assert_allclose([c.frequency for c in seen[:2]], [440, 447], rtol=1e-6)
    np.testing.assert_allclose([c.damping for c in seen[:2]], [2, 5], rtol=1e-3)
    np.testing.assert_allclose([c.amplitude for c in seen[:2]], [1, 0.3], rtol=1e-3)
    assert silent is not None and components(silent) == []
    assert band(sound[:100], RATE, 441.0, 150.0) is None, "shorter than the filter"


def test_a_partial_that_is_two(tmp_path: Path) -> None:
    """Two polarisations: the line that dies sooner is u, the other v."""
    nu, sigma = np.array(FREQUENCIES[:20]), np.array(DAMPINGS[:20])
    sound = ring(np.ones(20), nu, sigma, 4.0) + ring([0.4, 0.4], [nu[4] + 0.8, nu[9] - 1.5], [0.3, 2.0], 4.0)
    result = identify([save(tmp_path / "g.wav", 0.02 * noisy(sound, 50))], load_preset("paper-g"), modes=20)
    assert {p.number for p in result.partials if p.v} == {5, 10}
    for p in result.partials:
        expected = [(nu[p.number - 1], sigma[p.number - 1])]
        expected += {5: [(nu[4] + 0.8, 0.3)], 10: [(nu[9] - 1.5, 2.0)]}.get(p.number, [])
        u, *v = sorted(expected, key=lambda line: -line[1])
        np.testing.assert_allclose((p.u.frequency, p.u.damping), u, rtol=0.02)
        np.testing.assert_allclose(p.u.frequency, u[0], rtol=1e-5)
        if v:
            assert p.v is not None
            np.testing.assert_allclose((p.v.frequency, p.v.damping), v[0], rtol=0.02)
        else:
            assert (p.frequency, p.damping) == (p.u.frequency, p.u.damping)
    assert result.across is not None and [d.number for d in result.across.partials] == [5, 10]


def test_partials_that_are_not_there(tmp_path: Path) -> None:
    """A string plucked at a fifth of its length has no partials 5, 10 ..."""
    s = speaking(LAW_ONLY, g_neck(), 0)
    path = save(tmp_path / "g.wav", noisy(pluck(s, at=s.length / 5), 40))
    result = identify([path], load_preset("paper-g"), modes=22)
    assert set(result.missing) == {5, 10, 15, 20}
    assert len(result.string.measured_frequencies) == len(result.string.measured_dampings) == 22
    np.testing.assert_allclose(result.string.measured_frequencies, modes.frequencies(s, 22), rtol=1e-4)
    np.testing.assert_allclose(result.string.measured_dampings, modes.dampings(s, 22), rtol=0.2)
    assert np.all(np.diff(result.string.measured_frequencies) > 0)


def test_several_takes(tmp_path: Path) -> None:
    """Three notes in a file, the first two cut short by the next, and one in another file."""
    four = [noisy(pluck(seconds=2.0), 40, seed) for seed in range(3)]
    together = save(tmp_path / "three.flac", np.concatenate(four), subtype="PCM_24")
    other = save(tmp_path / "one.wav", noisy(pluck(seconds=3.0), 40, 9))
    assert [len(find_takes(read_recording(p), 0.02, 5.0)) for p in (together, other)] == [3, 1]
    result = identify([together, other], load_preset("paper-g"), modes=16)
    assert len(result.takes) == 4 and {p.takes for p in result.partials} == {4}
    off_frequency, off_damping = errors(result)
    assert max(off_frequency.values()) < 2e-5 and max(off_damping.values()) < 0.02
    sigma = modes.dampings(paper_g(), 16)
    inside = [abs(p.damping - sigma[p.number - 1]) < p.damping_u for p in result.partials]
    assert np.mean(inside) > 0.8
    assert all(0 < p.damping_u < 0.1 * p.damping for p in result.partials)


@pytest.mark.parametrize(
    ("rate", "kind"), quick([(44_100, "PCM_16"), (48_000, "PCM_24"), (96_000, "FLOAT")], [(48_000, "PCM_24")])
)
def test_rates_formats_and_channels(tmp_path: Path, rate: int, kind: str) -> None:
    left = noisy(pluck(seconds=3.0, rate=rate), 60, lead=rate // 4)
    left -= left.mean()
    sound = np.stack([0.01 * np.roll(left, rate // 100), left + 0.2], axis=1)  # with an offset, like a sensor's
    path = save(tmp_path / "g.wav", sound, rate, kind)
    assert np.allclose(read_recording(path).sound, left, atol=1e-4)
    assert np.allclose(read_recording(path, channel=1).sound, sound[:, 0], atol=1e-4)
    off_frequency, off_damping = errors(identify([path], load_preset("paper-g"), modes=30))
    assert len(off_frequency) == 30
    assert max(off_frequency.values()) < 1e-5 and max(off_damping.values()) < 1e-2


@pytest.mark.parametrize(
    ("law", "fundamental"), quick([("paper", 1e-5), ("hinged", 2e-5)], [])
)  # the neck shifts partials; test_a_stiff_string_from_its_sound has an E too
def test_the_lowest_string(tmp_path: Path, law: str, fundamental: float) -> None:
    """An E with 24 ms periods, with neither string nor note given."""
    bass = load_preset("jazz-finger")
    string = replace(bass.strings[0], stiffness_law=law, viscoelastic_angle=0.006, thermoelastic=6e-6)
    s = speaking(string, bass.necks[0], 0)
    result = identify([save(tmp_path / "e.wav", noisy(pluck(s, seconds=5.0), 50))], bass, modes=40)
    assert result.string.name == "E" and len(result.partials) == 40
    off_frequency, off_damping = errors(result, s)
    assert max(off_frequency.values()) < 1e-4 and max(off_damping.values()) < 0.05
    assert result.law.stiffness_law == law
    assert result.law.fundamental == pytest.approx(s.fundamental, rel=fundamental)
    assert result.law.inharmonicity == pytest.approx(s.inharmonicity, rel=1e-2)


@pytest.mark.slow
def test_a_take_of_something_else_is_left_out(run: Run, tmp_path: Path) -> None:
    paths = [save(tmp_path / f"{k}.wav", noisy(pluck(seconds=2.0), 50, k)) for k in range(2)]
    other = ring([1, 1, 1], [130.8, 261.6, 392.4], [1, 1, 1], 2.0)
    paths.insert(0, save(tmp_path / "c.wav", noisy(0.2 * other, 50)))
    status, out, err = run("identify", *paths, "--modes", 10)
    assert status == 0 and "10 partials from 2 notes, 1 more not used" in err and " 97.97" in out


def test_a_stopped_note_ends_there(tmp_path: Path) -> None:
    sound = pluck(seconds=3.0)
    t = np.arange(sound.size) / RATE
    sound = sound * np.where(t > 2, np.exp(-90 * np.maximum(t - 2, 0)), 1)
    takes = find_takes(read_recording(save(tmp_path / "g.wav", noisy(sound, 60))), 0.02, 5.0)
    assert len(takes) == 1 and 1.8 < takes[0].start_s + takes[0].duration_s - 0.25 < 2.0


def test_a_string_that_follows_the_laws() -> None:
    """Its parameters of eqs. 8 to 11 are found, and nothing remains for the neck."""
    s, j = speaking(LAW_ONLY, g_neck(), 0), np.arange(1, 61)
    law = fit_law(j, modes.frequencies(s, 60), "paper")
    assert (law.fundamental, law.inharmonicity) == (pytest.approx(97.976), pytest.approx(3.5e-5))
    string = replace(LAW_ONLY, tension=LAW_ONLY.linear_density * (2 * 0.863 * 97.976) ** 2)
    sigma = modes.dampings(speaking(string, g_neck(), 0), 60)
    losses = fit_losses(replace(string, viscoelastic_angle=0.006), g_neck(), j, sigma, 1e-3 * sigma)
    assert losses.viscoelastic_angle == pytest.approx(0.01, rel=0.01)
    assert losses.diameter == pytest.approx(1.14e-3, rel=0.03)
    assert losses.thermoelastic == pytest.approx(6e-6, rel=0.3) and losses.conductance == ()
    assert fit_law(j[:4], modes.frequencies(s, 4), "paper", known=1e-5).inharmonicity == 1e-5
    with pytest.raises(ValueError, match="one partial"):
        fit_law(j[:1], np.array([98.0]), "paper")


@pytest.mark.parametrize("law", STIFFNESS_LAWS)
@pytest.mark.parametrize("base", STIFFNESS_LAWS)
def test_which_law_the_partials_follow(law: str, base: str) -> None:
    """Each law returns its own figures, whatever the preset has; the other one is far off on a stiff string."""
    bass = load_preset("jazz-finger")
    string = replace(bass.strings[0], inharmonicity=2e-4, stiffness_law=law)
    s, j = speaking(string, bass.necks[0], 0), np.arange(1, 61)
    better, other = fit_laws(j, modes.frequencies(s, 60), replace(string, stiffness_law=base))
    assert (better.stiffness_law, other.stiffness_law) == (law, next(k for k in STIFFNESS_LAWS if k != law))
    assert abs(cents(better.fundamental / s.fundamental)) < 1 < 20 < abs(cents(other.fundamental / s.fundamental))
    assert better.inharmonicity == pytest.approx(2e-4, rel=0.02) and abs(other.inharmonicity / 2e-4 - 1) > 0.15
    assert better.misfit < 5e-4 < 5e-3 < other.misfit


def test_few_partials_tell_no_law() -> None:
    """The published modes of the G up to 20 or 10, shifted by the neck: the preset's law stays."""
    for base in STIFFNESS_LAWS:
        string = replace(g_string(), stiffness_law=base)
        for count in (10, 20):
            first, _ = fit_laws(np.arange(1, count + 1), np.array(FREQUENCIES[:count]), string)
            assert first.stiffness_law == base and (count > 10 or first.inharmonicity == 3.5e-5)


def test_a_stiff_string_from_its_sound(run: Run, tmp_path: Path) -> None:
    """Within 1 cent in f0 and 2 % in B; the written preset has the law, in its table too."""
    bass = load_preset("jazz-finger")
    string = replace(bass.strings[0], inharmonicity=2e-4)
    s = speaking(string, bass.necks[0], 0)
    save(tmp_path / "e.wav", noisy(pluck(s, seconds=5.0), 60))
    out = cli_text(run, "identify", tmp_path / "e.wav", "-p", "paper-bass", "-o", tmp_path / "mine.toml")
    assert "law of partials: hinged" in out and "by paper" in out
    made = load_preset(str(tmp_path / "mine.toml")).strings[0]
    assert made.stiffness_law == "hinged" and made.inharmonicity == pytest.approx(2e-4, rel=0.02)
    assert abs(cents(made.law_fundamental / s.fundamental)) < 1


def test_the_neck_takes_the_rest() -> None:
    """The fitted law leaves nearly as much to the neck as the paper's parameters do (eqs. 9 to 11)."""
    s, j = paper_g(), np.arange(1, 61)
    law = fit_law(j, modes.frequencies(s, 60), "paper")
    assert law.fundamental == pytest.approx(97.976, rel=1e-4) and law.inharmonicity == pytest.approx(3.5e-5, rel=0.01)
    sigma = modes.dampings(s, 60)
    losses = fit_losses(g_string(), g_neck(), j, sigma, 0.01 * sigma)
    assert losses.viscoelastic_angle == pytest.approx(0.01, rel=0.03)
    nu, found = np.array(losses.conductance[:20]).T
    nominal = j[:20] * s.string.nominal_fundamental
    rest = sigma[:20] - math.pi * nominal * modes.loss_factor(s, nominal)
    np.testing.assert_allclose(found, rest / neck_damping(1.0, modes.impedance(s), s.fundamental), atol=7e-4)
    np.testing.assert_allclose(nu, modes.frequencies(s, 20), rtol=1e-9)


def straight(folder: Path) -> Path:
    """Jazz-finger plucked straight up, which sounds u alone."""
    text = re.sub("(?m)^(pluck_angle|angle_when_hard) = .*$", r'\1 = "0 deg"', preset_source("jazz-finger")[1])
    (folder / "straight.toml").write_text(text)
    return folder / "straight.toml"


def test_a_preset_that_plays(run: Run, tmp_path: Path) -> None:
    save(tmp_path / "g.wav", noisy(pluck(), 60))
    out = cli_text(run, "identify", tmp_path / "g.wav", "--modes", 30, "-o", tmp_path / "mine.toml", "--only-string",
                   "--json", tmp_path / "g.json", "--csv", tmp_path / "g.csv", "-p", straight(tmp_path))  # fmt: skip
    assert "97.9732" in out and "f0 98." in out and "viscoelastic angle" in out
    made, base = load_preset(str(tmp_path / "mine.toml")), load_preset(str(straight(tmp_path)))
    assert (made.strings[:3], made.output, made.player) == (base.strings[:3], base.output, base.player)
    np.testing.assert_allclose(made.strings[3].measured_frequencies, FREQUENCIES[:30], rtol=1e-6)
    np.testing.assert_allclose(made.strings[3].measured_dampings, DAMPINGS[:30], rtol=5e-3)
    text = (tmp_path / "mine.toml").read_text()
    assert text.startswith("# String G is identified from g.wav") and "Unit weights and tensions" in text
    said, table = json.loads((tmp_path / "g.json").read_text()), list(csv.DictReader((tmp_path / "g.csv").open()))
    assert len(said["partials"]) == len(table) == 30 and said["string"] == "G"
    assert float(table[7]["damping_per_s"]) == pytest.approx(DAMPINGS[7], rel=1e-3)
    assert said["partials"][7]["v_frequency_hz"] is None and table[7]["v_frequency_hz"] == ""
    assert said["partials"][0]["t60_s"] == pytest.approx(3 * math.log(10) / DAMPINGS[0], rel=1e-2)


@pytest.mark.slow
def test_a_neck_of_resonances(run: Run, tmp_path: Path) -> None:
    """Resonances replace a table in the preset, and a table replaces resonances."""
    save(tmp_path / "g.wav", noisy(pluck(), 60))
    mine, again = tmp_path / "mine.toml", tmp_path / "again.toml"
    arguments = ["identify", tmp_path / "g.wav", "--modes", 20, "--json", tmp_path / "g.json"]
    out = cli_text(run, *arguments, "--neck", "resonances", "-p", straight(tmp_path), "-o", mine)
    assert "% rms" in out and "neck Hz" in out
    neck, said = load_preset(str(mine)).necks[3].admittance, json.loads((tmp_path / "g.json").read_text())
    assert 4 <= len(neck.resonances) == len(said["resonances"]) <= 16 and not neck.table
    assert neck.resonances[0].mass == pytest.approx(said["resonances"][0]["mass_kg"], rel=1e-2)
    law = replace(load_preset(str(mine)).strings[3], measured_dampings=())
    s = replace(speaking(law, g_neck(), 0), admittance=neck)
    np.testing.assert_allclose(modes.dampings(s, 20), DAMPINGS[:20], rtol=0.35)
    cli_text(run, *arguments, "-p", mine, "-o", again)
    neck = load_preset(str(again)).necks[3].admittance
    assert neck.table and not neck.resonances
    assert run("identify", tmp_path / "g.wav", "--neck", "wood")[0] == 2


@pytest.mark.parametrize(
    "base", quick(["paper-g", "paper-bass", "precision-finger", "flatwound", "slap", "muted"], ["paper-g"])
)
def test_every_preset_takes_a_measured_string(run: Run, tmp_path: Path, base: str) -> None:
    """With or without a neck table, core, conductance or mute; the new file must be valid TOML."""
    save(tmp_path / "g.wav", noisy(pluck(seconds=2.0), 60))
    mine = tmp_path / "mine.toml"
    cli_text(run, "identify", tmp_path / "g.wav", "-p", base, "--modes", 12, "-o", mine)
    assert "good" in cli_text(run, "presets", "check", mine)
    string = load_preset(str(mine)).strings[-1]
    assert len(string.measured_dampings) == 12 and string.extra_damping == 0
    cli_text(run, "identify", tmp_path / "g.wav", "-p", mine, "--modes", 8, "-o", mine)  # and again, over itself
    assert len(load_preset(str(mine)).strings[-1].measured_dampings) == 8


@pytest.mark.slow
def test_another_tuning(run: Run, tmp_path: Path) -> None:
    bass = load_preset("jazz-finger")
    low = replace(bass.strings[0], open_note=26, tension=142.4)  # D1
    save(tmp_path / "d.wav", noisy(pluck(speaking(low, bass.necks[0], 0), seconds=4.0), 60))
    err = refusal(run, "identify", tmp_path / "d.wav", status=1)
    assert "more than a semitone" in err and "--note" in err
    arguments = ["--string", "E", "--note", "D1", "--modes", 20, "-o", tmp_path / "drop.toml"]
    cli_text(run, "identify", tmp_path / "d.wav", *arguments)
    made = load_preset(str(tmp_path / "drop.toml")).strings[0]
    s = speaking(low, bass.necks[0], 0)
    assert made.open_note == 26 and made.law_fundamental == pytest.approx(s.fundamental, rel=1e-4)
    np.testing.assert_allclose(made.measured_frequencies, modes.frequencies(s, 20), rtol=1e-5)
    assert tomllib.loads((tmp_path / "drop.toml").read_text())["string"][0]["open_note"] == "D1"


@pytest.mark.parametrize(
    ("file", "string", "f0", "inharmonicity", "minimum"),
    quick(REAL, []),  # an example of the README, which always runs, has the G
)
def test_a_real_bass(
    run: Run, tmp_path: Path, file: str, string: str, f0: float, inharmonicity: tuple[float, float], minimum: int
) -> None:
    """Recordings under the MIT licence, see recordings/LICENSE. The G of the paper, on another bass, has B = 3.5e-5."""
    path, mine, figures = RECORDINGS / file, tmp_path / "mine.toml", tmp_path / "mine.json"
    cli_text(run, "identify", path, "-o", mine, "--json", figures)
    said = json.loads(figures.read_text())
    assert said["string"] == string and len(said["partials"]) >= minimum and not said["rejected_takes"]
    assert said["f0_hz"] == pytest.approx(f0, rel=0.015)
    assert inharmonicity[0] < said["inharmonicity"] < inharmonicity[1]
    low = said["partials"][:5]
    np.testing.assert_allclose([p["frequency_hz"] / p["partial"] for p in low], f0, rtol=5e-3)
    assert all(0.1 < p["damping_per_s"] < 4 for p in low)  # T60 of 2 to 70 s
    assert "good" in cli_text(run, "presets", "check", mine)


def bad_recordings(folder: Path) -> dict[str, Path]:
    noise = np.random.default_rng(3).normal(size=2 * RATE)
    good = pluck(seconds=1.0)
    paths = {
        "silent": save(folder / "silence.wav", np.zeros(RATE)),
        "no pitch": save(folder / "noise.wav", 0.1 * noise),
        "too short": save(folder / "short.wav", good[: RATE // 10]),
        "not finite": save(folder / "nan.wav", np.where(np.arange(RATE) == 500, np.nan, good)),
        "is empty": save(folder / "empty.wav", np.zeros(0)),
        "a directory": folder,
        "no such file": folder / "nowhere.wav",
        "cannot be read as sound": folder / "text.wav",
    }
    paths["cannot be read as sound"].write_text("no sound at all")
    return paths


@pytest.mark.parametrize(
    "why", ["silent", "no pitch", "too short", "not finite", "is empty", "a directory", "no such file",
            "cannot be read as sound"]
)  # fmt: skip
def test_recordings_that_cannot_be_used(run: Run, tmp_path: Path, why: str) -> None:
    path = bad_recordings(tmp_path)[why]
    files = sorted(tmp_path.iterdir())
    err = refusal(run, "identify", path, "-o", tmp_path / "mine.toml", "--json", tmp_path / "mine.json", status=1)
    assert why in err and str(path) in err
    assert sorted(tmp_path.iterdir()) == files


def test_wrong_usage(run: Run, tmp_path: Path) -> None:
    path = save(tmp_path / "g.wav", noisy(pluck(seconds=2.0), 60))
    for arguments, status, why in (
        ([], 2, "RECORDING"),
        ([path, "--note", "G2", "--f0", "98Hz"], 2, "one of"),
        ([path, "-o", tmp_path / "mine"], 2, ".toml"),
        ([path, "--json", path], 2, "recording itself"),
        ([path, "--csv", tmp_path], 1, "directory"),
        ([path, "--string", "H"], 1, "has E, A, D, G"),
        ([path, "--string", "E"], 1, "no pitch within a semitone"),
        ([path, "--note", "D2"], 1, "no pitch within a semitone"),
        ([path, "--channel", 2], 1, "no channel 2"),
        ([path, "--modes", 3], 2, "must be a whole number from 4 to 200, not 3"),
        ([path, "-p", "nothing"], 1, "unknown"),
        ([path, "--start", "3s"], 1, "too short"),
    ):
        err = refusal(run, "identify", *arguments, status=status)
        assert why in err, (arguments, err)
    assert list(tmp_path.iterdir()) == [path]


def test_a_low_e_whose_second_partial_is_far_above_the_first(run: Run, tmp_path: Path) -> None:
    """Low strings of most basses have it at +5 to +19 dB, between the places of their pickups."""
    path = save(tmp_path / "e.wav", noisy(np.concatenate([np.zeros(RATE // 5), uneven(41.2, {2: 18}, 3.0)]), 80))
    status, out, err = run("identify", path, "--only-string")
    assert status == 0 and "string E" in err and " 41.20" in out


def test_a_sine_is_no_string(run: Run, tmp_path: Path) -> None:
    t = np.arange(2 * RATE) / RATE
    save(tmp_path / "sine.wav", np.exp(-t) * np.sin(2 * np.pi * 98 * t))
    assert "1 partial of a string" in refusal(run, "identify", tmp_path / "sine.wav", status=1)
