"""A fit to notes of a known bass: the score finds it, the preset holds what was scored, the command writes it whole."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from support.command import Run, refusal
from support.costs import of_each_kind
from support.fits import problem_of, real_notes

from livebass.lab.comparison.notes import Note
from livebass.lab.fitting.notes import Place
from livebass.lab.fitting.problem import Problem

pytest.importorskip("cmaes")
pytest.importorskip("scipy")
from support.fits import BASE, KNOWN, LOSS, NAME, PLACES, TONE, TRUTH

from livebass.engine.engine import Engine
from livebass.lab.comparison.notes import spread_velocities
from livebass.lab.fitting import bounds, estimates, judge, plan, search
from livebass.lab.fitting.bounds import FREE, HARDEST, Free, free_numbers, own_tables, step
from livebass.lab.fitting.notes import Recorded
from livebass.lab.fitting.page import _in_words
from livebass.lab.fitting.playing import DEFAULT_RATE, play_note, velocity_of
from livebass.lab.fitting.preset_text import changes_from, preset_text
from livebass.lab.fitting.problem import HOPELESS, solve_task
from livebass.lab.fitting.request import Fit
from livebass.lab.fitting.target import Difference, measure_note, searched_figures
from livebass.model.quality import QUALITIES
from livebass.preset.build import Builder
from livebass.preset.load import load_preset, preset_names, preset_tables
from livebass.report.progress import Say


@pytest.fixture(scope="module")
def real() -> dict[Place, Note]:
    return real_notes()


@pytest.fixture(scope="module")
def problem(real: dict[Place, Note]) -> Problem:
    return problem_of(real)


def test_the_score_falls_towards_the_truth(problem: Problem) -> None:
    truth = [f.on_scale(v) for f, v in zip(problem.free, TRUTH, strict=True)]
    start = problem.start()
    halfway = [(a + b) / 2 for a, b in zip(start, truth, strict=True)]
    scores = [problem.solve(u)["distance"] for u in (start, halfway, truth)]
    assert scores[0] > scores[1] > scores[2] and scores[2] < 0.6
    assert problem.solve(truth)["score"] < 0.6 * problem.solve(start)["score"]
    assert problem.solve(truth) == problem.solve(truth)


def test_a_score_feels_steep_dynamics_and_spikes(real: dict[Place, Note]) -> None:
    """Hard notes that are 9 dB too loud, or whose attack stands 6 dB higher, count as much as a handful of rows."""
    theirs = {p: (measure_note(n.sound, n.rate, n.pitch, searched_figures("fingers")),) for p, n in real.items()}
    problem = Problem(NAME, BASE, "fingers", 2, theirs)

    def played(gain: float, spike: float) -> tuple[float, dict[tuple[str, int], Difference]]:
        ours = {p: takes[0] for p, takes in theirs.items()}
        loud = ours[PLACES[1]]
        figures = loud.figures | {"level": loud.figures["level"] + gain, "crest": loud.figures["crest"] + spike}
        score, rows = problem.compare(ours | {PLACES[1]: replace(loud, figures=figures)})
        return score.rows, rows

    assert played(0.0, 0.0)[0] == 0.0
    steep, rows = played(9.0, 0.0)
    assert [rows["level", rank].spreads for rank in (0, 1)] == pytest.approx([-1.5, 1.5])  # 9 dB, apart from the mean
    spiky, rows = played(0.0, 6.0)
    assert rows["crest", 1] == pytest.approx((2.0, rows["crest", 1].theirs, rows["crest", 1].theirs + 6.0))
    rest = len(rows) - 4
    assert steep == pytest.approx(4 * 3.0 / (rest + 16)) and spiky == pytest.approx(4 * 2.0 / (rest + 16))
    assert _in_words("crest", "hard", rows["crest", 1]).startswith(
        "peak over the level of the first 0.3 s, hard notes: "
    )


def test_what_no_bass_can_be_is_hopeless_and_no_error(problem: Problem) -> None:
    impossible = Problem(NAME, BASE, "fingers", 2, problem.theirs, (Free("player", "softest", "", 9.0, 10.0),))
    assert impossible.solve([0.5])["score"] == HOPELESS
    assert math.isnan(impossible.solve([0.5])["rows"])


def test_losses_are_read_off_the_decay(real: dict[Place, Note]) -> None:
    reported = estimates.losses(load_preset(NAME), record(real), FREE)
    assert reported["thermoelastic"] == pytest.approx(TRUTH[0], rel=0.5)  # 1.6e-4 in the base preset


def record(takes: dict[Place, Note], **more: Any) -> Recorded:
    layers = tuple(f"v{k}" for k in range(1 + max(p.rank for p in takes)))
    given: dict[str, Any] = {"releases": (), "quiet": (), "normalized": True, "doubts": (), "digest": ""}
    return Recorded("a", "fingers", {p: (n,) for p, n in takes.items()}, layers, **(given | more))


def test_noise_is_read_off_a_silence_or_what_precedes_the_notes(problem: Problem) -> None:
    rng = np.random.default_rng(1)

    def noise(seconds: float, level_db: float) -> np.ndarray[Any, Any]:
        return 10 ** (level_db / 20) * rng.standard_normal(round(seconds * DEFAULT_RATE))

    band = 10 * math.log10(DEFAULT_RATE / 2 / estimates.WIDTH)  # white noise over its part in the floor, dB
    tone = np.sin(2 * math.pi * 110 * np.arange(DEFAULT_RATE) / DEFAULT_RATE)  # -3 dB
    note = Note("", tone, DEFAULT_RATE, 110.0)
    silent = record({PLACES[0]: note}, quiet=(Note("", noise(1.0, -53.0 + band), DEFAULT_RATE, 0.0),))
    assert estimates.floor(silent, problem) == pytest.approx(-50, abs=0.3)
    led = replace(note, sound=np.concatenate([noise(0.1, -63.0 + band), tone]))
    assert estimates.floor(record({PLACES[0]: led}), problem) == pytest.approx(-60, abs=0.8)


@pytest.mark.parametrize("wanted", [0.0, 500.0, 3000.0])
def test_the_corner_of_flicker_noise_is_read_off_a_silence(problem: Problem, wanted: float) -> None:
    rng = np.random.default_rng(3)
    nu = np.fft.rfftfreq(4 * DEFAULT_RATE, 1 / DEFAULT_RATE)
    rise = np.sqrt(1 + wanted / np.maximum(nu, 20.0))
    noise = np.fft.irfft(np.fft.rfft(1e-3 * rng.standard_normal(4 * DEFAULT_RATE)) * rise)
    tone = Note("", np.sin(2 * math.pi * 110 * np.arange(DEFAULT_RATE) / DEFAULT_RATE), DEFAULT_RATE, 110.0)
    silent = record({PLACES[0]: tone}, quiet=(Note("", noise, DEFAULT_RATE, 0.0),))
    assert estimates.corner(silent, problem.bass) == pytest.approx(wanted, rel=0.15, abs=40)
    assert estimates.corner(record({PLACES[0]: tone}), problem.bass) is None


@pytest.mark.parametrize("mains", [50.0, 60.0])
def test_hum_is_told_from_noise(problem: Problem, mains: float) -> None:
    rng = np.random.default_rng(2)
    time = np.arange(5 * DEFAULT_RATE) / DEFAULT_RATE
    tone = Note("", np.sin(2 * math.pi * 110 * time[:DEFAULT_RATE]), DEFAULT_RATE, 110.0)  # -3 dB
    white = 10 ** ((-63.0 + 10 * math.log10(DEFAULT_RATE / 2 / estimates.WIDTH)) / 20) * rng.standard_normal(time.size)
    harmonics = np.sum([np.sin(2 * math.pi * k * mains * time + k) / k for k in (1, 2, 3, 5, 7)], axis=0)
    mains_hum = 10 ** (-43 / 20) * harmonics / np.std(harmonics)

    def silence(sound: np.ndarray[Any, Any]) -> Recorded:
        return record({PLACES[0]: tone}, quiet=(Note("", sound, DEFAULT_RATE, 0.0),))

    assert estimates.hum(silence(white), problem.bass) is None
    found = estimates.hum(silence(white + mains_hum), problem.bass)
    assert found == (pytest.approx(-40, abs=0.3), mains)
    assert estimates.floor(silence(white + mains_hum), problem) == pytest.approx(-60, abs=1)
    assert estimates.hum(record({PLACES[0]: tone}), problem.bass) is None
    assert estimates.hum(silence(0 * white), problem.bass) is None
    assert estimates.floor(silence(0 * white), problem) == estimates.FLOORS[0]


def test_a_release_knocks_as_recorded(real: dict[Place, Note]) -> None:
    tables = {**BASE, "player": {**BASE["player"], "release_noise": "8 dB", "release_spread": 0}}
    loud = Engine(Builder(NAME).instrument(tables), QUALITIES["live"], DEFAULT_RATE, workers=1)
    places = [Place(key, "", 0) for key in (32, 37, 42)]
    takes = {
        p: Note("", play_note(loud.another(1), i, p.key, 90, 1.5), DEFAULT_RATE, 0.0) for i, p in enumerate(places)
    }
    releases = tuple(
        Note("", play_note(loud.another(1), i, p.key, 90, 1.4, 1.0)[DEFAULT_RATE:], DEFAULT_RATE, 0.0)
        for i, p in enumerate(places)
    )
    assert estimates.knock(record(takes, releases=releases), load_preset(NAME)) == pytest.approx(8, abs=2.5)
    assert estimates.knock(record(takes), load_preset(NAME)) is None


def test_a_relaxation_is_fitted_where_the_base_has_one_and_damps_the_highs() -> None:
    bass = load_preset("jazz-finger")
    plain = replace(bass, strings=tuple(replace(s, relaxation=0.0) for s in bass.strings))
    with_it, without = ({f.key for f in free_numbers(each)} for each in (bass, plain))
    assert with_it - without == {"relaxation"}
    few, many = (estimates._t60(plain, 0, 0, {"relaxation": loss}) for loss in (1e-4, 4e-3))
    assert np.median(many[20:40] / few[20:40]) < 0.5 and many[0] > 0.9 * few[0]


def test_only_a_palm_that_rests_is_fitted() -> None:
    muted, free = ({f.key for f in free_numbers(load_preset(name))} for name in ("muted", NAME))
    assert muted - free == {"palm_resistance", "palm_place", "palm_width"}


@pytest.mark.parametrize("name", of_each_kind(n for n in preset_names() if not n.startswith("paper")))
def test_every_free_number_of_every_preset_moves_it_within_its_bounds(name: str) -> None:
    label, tables = preset_tables(name)
    bass = Builder(label).instrument(tables)
    free = free_numbers(bass)
    assert len({f.name for f in free}) == len(free) >= 6 and all(f.name for f in free)
    for f in free:
        assert f.value(f.on_scale(f.read(bass))) == pytest.approx(f.read(bass), rel=1e-6)
    problem = Problem(label, tables, "fingers", 1, {}, tuple(free))
    lightest = 0.2 if name == "precision-pick" else 0.0  # lighter resonances move a mode too far: no preset
    for u in (0.0, 0.5, 1.0):
        values = [f.value(max(u, lightest) if f.section == bounds.MASSES else u) for f in free]
        made = Builder(label).instrument(problem.tables(values))
        for f, value in zip(free, values, strict=True):
            if f.section not in (*bounds.FACTORS, bounds.MIX) and f.key != "angle_when_hard":
                assert f.read(made) == pytest.approx(value, rel=1e-3, abs=1e-9), f.name


def test_forces_of_layers_become_velocities() -> None:
    free = (HARDEST, step("soft", "medium"), step("medium", "hard"))
    theirs = {Place(33, "", rank): () for rank in (0, 2, 3)}
    made = Problem(NAME, BASE, "fingers", 4, theirs, free)
    player = Builder(NAME).instrument(made.tables([5.5, 4.0, 6.0])).player
    found = made.velocities(Builder(NAME).instrument(made.tables([5.5, 4.0, 6.0])), [5.5, 4.0, 6.0])
    forces = [5.0 * 10 ** (-x / 20) for x in (10.0, 8.0, 6.0, 0.0)]
    assert found == [velocity_of(player, force) for force in forces] and found == sorted(found)
    assert velocity_of(player, player.hardest) == 127 and velocity_of(player, 1e-9) == 1
    assert found[0] == spread_velocities(4)[0]  # the new softest force keeps the usual velocity of the softest layer
    levelled = replace(made, normalized=True)
    assert "softest" not in levelled.own([5.5, 4.0, 6.0])["player"]


def test_the_preset_holds_only_what_changed_and_is_the_bass_that_was_scored(tmp_path: Path) -> None:
    bass = load_preset(NAME)
    values = [f.value(0.4) for f in FREE]
    own = own_tables(bass, FREE, values, {"player": {"floor_noise": "-60 dB"}, "string": [{"name": s.name} for s in
                                                                                        bass.strings]})  # fmt: skip
    place = tmp_path / "mine.toml"
    place.write_text(preset_text(NAME, place, changes_from(own, BASE), {("coil", "tone"): "sd 0.1"}, ["one", "two"],
                                 name='My "bass"', description="d"))  # fmt: skip
    problem = Problem(NAME, BASE, "fingers", 1, {}, tuple(FREE), {"player": {"floor_noise": "-60 dB"}})
    made, scored = load_preset(place), Builder(NAME).instrument(problem.tables(values))
    assert (made.strings, made.necks, made.output, made.player) == (
        scored.strings, scored.necks, scored.output, scored.player
    )  # fmt: skip
    text = place.read_text()
    assert text.startswith(f'# one\n# two\nlike = "{NAME}"\nname = "My \\"bass\\""')
    assert "tone = 0.4  # sd 0.1" in text and "linear_density" not in text and made.name == 'My "bass"'
    assert changes_from(problem.own([f.read(bass) for f in FREE]), BASE).keys() <= {
        "player",
        "pickup",
        "neck",
        "string",
    }


def test_a_base_in_a_file_is_named_from_the_new_preset(tmp_path: Path) -> None:
    base = tmp_path / "bases" / "base.toml"
    base.parent.mkdir()
    base.write_text(f'like = "{NAME}"\nname = "base"\n')
    place = tmp_path / "mine.toml"
    place.write_text(preset_text(str(base), place, {"coil": {"tone": 0.5}}, {}, [], name="m", description=""))
    assert 'like = "bases/base.toml"' in place.read_text() and load_preset(place).output.coil.tone == 0.5


@contextlib.contextmanager
def _here(request: Fit, say: Say) -> Iterator[Any]:
    """Computes in this process."""

    def compute(tasks: Sequence[Any]) -> Iterator[tuple[Any, dict[str, float]]]:
        for task in tasks:
            yield task, solve_task(task.work)

    yield compute


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit of two numbers to two notes, judged by two. No trial's neck is checked: all can be played."""
    monkeypatch.setattr(Builder, "check_notes", lambda *_: None)
    monkeypatch.setattr("livebass.lab.fitting.request._computer", _here)
    monkeypatch.setattr(bounds, "FREE", (LOSS, TONE))
    monkeypatch.setattr(plan, "FITTED", 2)
    monkeypatch.setattr(plan, "JUDGES", 2)
    monkeypatch.setattr(search, "POPULATION", 6)
    monkeypatch.setattr(judge, "QUALITY", "live")
    monkeypatch.setattr(judge, "SEEDS", (11,))
    monkeypatch.setattr(judge, "SECONDS", 1.7)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Eight notes of a known bass."""
    made = tmp_path_factory.mktemp("fit") / "my-bass"
    made.mkdir()
    keys = {"E": 29, "A": 35, "D": 41, "G": 47}
    places = [Place(key, string, rank) for string, key in keys.items() for rank in (0, 1)]
    for place, note in KNOWN.play(TRUTH, places, seed=5).items():
        name = f"string{place.string}_{'soft' if place.rank == 0 else 'hard'}_{place.key}.wav"
        soundfile.write(made / name, np.r_[np.zeros(2000), note.sound], DEFAULT_RATE, subtype="FLOAT")
    return made


@pytest.mark.usefixtures("quick")
def test_the_command_fits_goes_on_and_gives_the_same_preset(run: Run, folder: Path, tmp_path: Path) -> None:
    given = ("fit", folder, "--like", NAME, "--evaluations", "12", "--no-page", "--seed", "3")
    status, out, err = run(*given, "-o", tmp_path / "a.toml")
    assert status == 0, err
    assert out.startswith("On 2 notes that the fit never heard, the new preset is")
    before, after = (float(out.split(f"{word} is ")[1].split(" dB")[0]) for word in (NAME, "preset"))
    assert after < 0.8 * before
    made = load_preset(tmp_path / "a.toml")
    assert made.strings[0].thermoelastic > 2 * load_preset(NAME).strings[0].thermoelastic
    text = (tmp_path / "a.toml").read_text()
    assert f"livebass fit my-bass --like {NAME} --seed 3 --evaluations 12" in text and "# sd " in text
    points = sorted((tmp_path / "a-points" / "points").iterdir())
    points[0].unlink()
    (tmp_path / "b-points").mkdir()
    (tmp_path / "a-points" / "points").rename(tmp_path / "b-points" / "points")
    assert run(*given, "-o", tmp_path / "b.toml")[0] == 0
    assert (tmp_path / "b.toml").read_text() == text
    assert len(list((tmp_path / "b-points" / "points").iterdir())) == len(points)


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_the_page_says_it_in_one_sentence_and_shows_before_and_after(run: Run, folder: Path, tmp_path: Path) -> None:
    status, out, err = run("fit", folder, "--evaluations", "12", "--beside", folder, "-o", tmp_path / "a.toml")
    assert status == 0, err
    page = (tmp_path / "a.html").read_text()
    assert out.strip().rstrip(".") in page and "my-bass 0.0 dB" in out
    for said in ("before: ", "after: a", "What the fit moved", "<audio", "Spectrograms", "The best score"):
        assert said in page


@pytest.mark.usefixtures("quick")
def test_ctrl_c_says_that_trials_are_kept(
    run: Run, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    count = 0

    def interrupted(_: Problem, scaled: Sequence[float]) -> dict[str, float]:
        nonlocal count
        count += 1
        if count == 5:
            raise KeyboardInterrupt
        return dict.fromkeys(search.PARTS, 1.0)

    monkeypatch.setattr(Problem, "solve", interrupted)
    status, out, err = run("fit", folder, "--like", NAME, "--no-page", "-o", tmp_path / "a.toml")
    assert status == 130 and not out
    assert "interrupted, 4 trials are kept in" in err.splitlines()[-1] and "goes on" in err.splitlines()[-1]
    assert len(list((tmp_path / "a-points" / "points").glob("[!.]*.json"))) == 4
    assert {p.name for p in tmp_path.iterdir()} == {"a-points"}


def test_bad_input_is_one_line(run: Run, folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    output = ("-o", tmp_path / "a.toml")
    cases = [
        ((folder,), 2, "-o FILE.toml"),
        (output, 2, "NOTES"),
        ((folder, "-o", tmp_path / "a.txt"), 2, ".toml"),
        ((empty, *output), 1, "has no sound file"),
        ((tmp_path / "none", *output), 1, "none"),
        ((folder, "--like", "nobody", *output), 1, "preset \"nobody\": unknown"),
        ((folder, "--like", "upright", "--technique", "strum", *output), 2, "strum"),
        ((folder, "--tuning", "B8 C9 D9 E9", *output), 1, "tuning"),
        ((folder, "--evaluations", "3", *output), 2, "12"),
        ((folder, "--workers", "2", "--scheduler", "h:1", *output), 2, "--scheduler"),
        ((folder, "-o", tmp_path / "no" / "a.toml"), 1, "no directory"),
    ]  # fmt: skip
    for arguments, status, said in cases:
        err = refusal(run, "fit", *arguments, status=status)
        assert said in err, err
    monkeypatch.setitem(__import__("sys").modules, "cmaes", None)
    assert "fit needs cmaes: " in refusal(run, "fit", folder, *output, status=1)
    assert {p.name for p in tmp_path.iterdir()} == {"empty"}
