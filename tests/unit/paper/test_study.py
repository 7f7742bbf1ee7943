"""The command `livebass study`: the files it writes, and the input it refuses."""

from __future__ import annotations

import csv
import json
import math
import re
import sys
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest
import soundfile
from support.command import Run, cli_text, refusal
from support.studies import NAMES, SHORT, shortened

from livebass.engine.solve import solve_trial
from livebass.lab.analysis.motion import Solved
from livebass.lab.paper.figures.measure import case_job
from livebass.lab.paper.figures.section_4 import convergence, convergence_jobs
from livebass.lab.paper.figures.studies import PLAYER, STUDIES, choose_studies, run_studies
from livebass.lab.paper.figures.study import Findings, Study, Table
from livebass.lab.paper.solving import Job, solve_all
from livebass.model.trial import Motion
from livebass.system.extras import install


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    return shortened(tmp_path_factory.mktemp("study") / "new" / "paper")


class Links(HTMLParser):
    """Collects every reference of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, str]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [(tag, value) for key, value in attrs if key in ("src", "href") and value]


def test_each_study_has_figures_data_and_sounds(done: tuple[Path, dict[str, Any]]) -> None:
    directory, result = done
    assert sorted(p.name for p in directory.iterdir()) == sorted([*NAMES, "index.html"])
    for name, summary in result["studies"].items():
        assert json.loads((directory / name / "summary.json").read_text()) == summary
        named = {summary["data"], "summary.json"}
        for figure in summary["figures"]:
            named |= {figure["png"], figure["svg"]}
            assert (directory / name / figure["png"]).read_bytes().startswith(b"\x89PNG")
            assert b"<svg" in (directory / name / figure["svg"]).read_bytes()[:1000]
        for sound in summary["sounds"]:
            named.add(sound["wav"])
            moved, rate = soundfile.read(directory / name / sound["wav"])
            assert rate == 44100 and moved.size == pytest.approx(SHORT * rate, abs=2)
            assert 20 * math.log10(np.abs(moved).max()) == pytest.approx(-1, abs=1e-3)
        for table in summary["tables"]:
            named.add(table["csv"])
            with open(directory / name / table["csv"], newline="") as file:
                rows = list(csv.reader(file))
            assert len({len(row) for row in rows}) == 1
            if "rows" in table:
                assert rows[0] == table["columns"] and len(rows) == 1 + len(table["rows"])
        assert named == {p.name for p in (directory / name).iterdir()}
    assert [len(result["studies"][name]["sounds"]) for name in NAMES] == [0, 1, 2]
    assert json.loads((directory.parent.parent / "all.json").read_text()) == result


def test_the_data_are_the_motion(done: tuple[Path, dict[str, Any]]) -> None:
    directory, result = done
    trial = case_job("a", SHORT).trial
    expected = solve_trial(trial)
    with np.load(directory / "a" / "result.npz") as data:
        np.testing.assert_array_equal(data["a_u_m"], expected.displacement_m)
        assert data["a_characteristic_time_s"].shape == data["a_u_characteristic_frequency_hz"].shape
        assert data["a_initial_u_m"].shape == (864,) and data["a_initial_u_m"].max() == pytest.approx(0.87e-3, rel=0.03)
    sound = result["studies"]["a"]["sounds"][0]
    peak = 10 ** (-1 / 20) * sound["metres_per_unit"]
    assert peak == pytest.approx(np.abs(expected.displacement_m).max(), rel=0.02)
    with np.load(directory / "oblique" / "result.npz") as data:
        assert data["oblique_v_m"][0] == pytest.approx(2.2e-3 * 18 / (863 - 640), rel=0.01)  # a straight line there
        assert data["oblique_u_m"][0] == pytest.approx(3.1e-3 * 9 / (863 - 640), rel=0.01)


def test_the_page_refers_to_files_beside_it(done: tuple[Path, dict[str, Any]]) -> None:
    directory, result = done
    links = Links((directory / "index.html").read_text()).found
    files = [(tag, unquote(link)) for tag, link in links if not link.startswith("#")]
    assert all((directory / link).is_file() for _, link in files)
    figures = sum(len(s["figures"]) for s in result["studies"].values())
    assert [tag for tag, _ in files].count("img") == figures
    assert [tag for tag, _ in files].count("audio") == 3
    assert {link for _, link in links if link.startswith("#")} == {f"#{name}" for name in NAMES}


def test_the_page_opens_with_its_verdict(done: tuple[Path, dict[str, Any]], tmp_path: Path) -> None:
    text = (done[0] / "index.html").read_text()
    assert text.index("<h1>") < text.index("study statements") < text.index("<nav>")
    reported = replace(
        STUDIES["statements"], jobs=lambda _: {}, report=lambda _: Findings(numbers={"verdict": "3 of <4>"})
    )
    run_studies([reported], tmp_path)
    text = (tmp_path / "index.html").read_text()
    assert text.index("<h1>") < text.index("3 of &lt;4&gt;") < text.index("<nav>") and 'href="#statements"' in text


def test_captions_differ_and_ticks_and_legends_have_room() -> None:
    """In figures of several motions, whose names are long."""
    several = choose_studies(["plucking-point", "neck", "stiffness"])
    jobs = {study.name: study.jobs(SHORT) for study in several}
    solved = solve_all(job for by_name in jobs.values() for job in by_name.values())
    for study in several:
        found = study.report({key: solved[job] for key, job in jobs[study.name].items()})
        captions = [picture.caption for picture in found.pictures]
        assert len(set(captions)) == len(captions), captions
        for picture in found.pictures:
            assert_room(picture.figure)


def test_the_ticks_of_the_convergence_have_room() -> None:
    jobs = convergence_jobs(SHORT)
    motion = solve_trial(case_job("a", SHORT).trial)
    noise = np.random.default_rng(1).standard_normal((len(jobs), motion.displacement_m.size)) * 1e-6
    motions = {
        key: Solved(job.trial, replace(motion, displacement_m=motion.displacement_m + part))
        for (key, job), part in zip(jobs.items(), noise, strict=True)
    }
    for picture in convergence(motions).pictures:
        assert_room(picture.figure)


def assert_room(drawn: Any) -> None:
    """No two tick labels on an axis touch, no legend or title leaves the figure, and levels have a reference."""
    drawn.canvas.draw()
    room = drawn.bbox
    for axis in drawn.axes:
        minimum, maximum = axis.get_xlim()
        boxes = [
            label.get_window_extent()
            for place, label in zip(axis.get_xticks(), axis.get_xticklabels(), strict=True)
            if label.get_text() and minimum <= place <= maximum
        ]
        boxes.sort(key=lambda box: box.x0)
        assert all(left.x1 < right.x0 for left, right in pairwise(boxes)), axis.get_xlabel()
        legend = axis.get_legend()
        if legend is not None:
            box = legend.get_window_extent()
            assert box.x0 >= room.x0 and box.x1 <= room.x1 and axis.get_window_extent().width > room.width / 4
        if axis.get_ylabel().startswith("level"):
            assert "loudest" in axis.get_ylabel()


def test_the_page_keeps_studies_of_earlier_runs(tmp_path: Path) -> None:
    directory, (linear, a) = tmp_path / "d", choose_studies(["linear", "a"])
    reported = Study("a", "Told again <&>", "1", "a table", lambda duration: {}, lambda motions: Findings())
    run_studies([linear], directory)
    first = {p.name: p.read_bytes() for p in (directory / "linear").iterdir() if p.suffix in (".png", ".svg", ".csv")}
    run_studies([reported], directory)
    text = (directory / "index.html").read_text()
    assert 'id="linear"' in text and "Told again &lt;&amp;&gt;" in text and "<&>" not in text
    (directory / "a" / "summary.json").write_text("broken")
    run_studies([linear], directory)
    assert 'id="a"' not in (directory / "index.html").read_text()
    assert {name: (directory / "linear" / name).read_bytes() for name in first} == first
    assert a.title


def test_cases_link_to_the_page_that_plays_them_where_there_is_one(tmp_path: Path) -> None:
    reported = [
        Study(name, "Told", "1", "a table", lambda duration: {}, lambda motions: Findings()) for name in ("b", "neck")
    ]
    link = 'href="page/livebass.html#case=b"'
    run_studies(reported, tmp_path)
    text = (tmp_path / "index.html").read_text()
    assert link not in text and text.count("<code>livebass page --link case=b</code>") == text.count("case=") == 1
    (tmp_path / PLAYER).parent.mkdir()
    (tmp_path / PLAYER).touch()
    run_studies(reported, tmp_path)
    text = (tmp_path / "index.html").read_text()
    assert link in text and text.count("#case=") == 1
    assert 'src="page/embed.js"' in text and text.count('<live-bass page="livebass.html" link="case=b"') == 1


def test_what_studies_share_is_solved_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    solved: list[Job] = []

    def solve(job: Job) -> Motion:
        solved.append(job)
        return solve_trial(replace(job.trial, modes=min(job.trial.modes, 20)))

    monkeypatch.setattr(Job, "solve", solve)
    studies = [
        replace(s, report=lambda motions: Findings()) for s in choose_studies(["b", "cases", "dispersion", "stiffness"])
    ]
    result = run_studies(studies, tmp_path, duration=SHORT, workers=1)
    assert len(solved) == len(set(solved)) == result["solutions"] == 6  # a, b, c, harmonic, soft; first 5 ms of b


def test_a_study_that_fails_leaves_those_before_it(tmp_path: Path) -> None:
    def fail(motions: object) -> Findings:
        raise ValueError("no such thing")

    good = Study("linear", "T", "1", "g", lambda _: {}, lambda _: Findings(tables=[Table("t", "c", ("x",), [(1,)])]))
    with pytest.raises(ValueError, match="no such thing"):
        run_studies([replace(good, name="a", report=fail)], tmp_path / "d" / "e")
    assert not list(tmp_path.iterdir())
    with pytest.raises(ValueError, match="no such thing"):
        run_studies([good, replace(good, name="a", report=fail)], tmp_path / "d")
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["d", "index.html", "linear", "summary.json", "t.csv"]
    assert "t.csv" in (tmp_path / "d" / "index.html").read_text()


def test_studies_are_told_and_on_the_page_one_by_one(tmp_path: Path) -> None:
    """If interrupted in the second, the page shows the first."""
    lines: list[str] = []

    def interrupted(motions: object) -> Findings:
        assert "t.csv" in (tmp_path / "index.html").read_text()
        raise KeyboardInterrupt

    first = Study("linear", "T", "1", "g", lambda _: {}, lambda _: Findings(tables=[Table("t", "c", ("x",), [(1,)])]))
    with pytest.raises(KeyboardInterrupt):
        run_studies([first, replace(first, name="a", report=interrupted)], tmp_path, say=lines.append)
    assert lines == ["study 1 of 2: linear", "study 2 of 2: a"]
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["index.html", "linear", "summary.json", "t.csv"]


def test_list_and_help(run: Run) -> None:
    listed = cli_text(run, "study", "list")
    assert all(re.search(rf"^{re.escape(name)} ", listed, re.M) for name in STUDIES)
    assert "study all -o" in cli_text(run, "study", "--help")
    assert "index.html" in cli_text(run, "study", "run", "--help")


def test_bad_input(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    for arguments, says, status in (
        (["study", "figure-99", "-o", "d"], "study 'figure-99': unknown; there are linear, a, b, c, cases", 2),
        (["study", "linear"], "'-o'", 2),
        (["study", "linear", "-o", "d", "--duration", "1ms"], "must be from 100 ms to 10 s, not 1ms", 2),
        (["study", "linear", "-o", "d", "--workers", "0"], "1 to 256", 2),
        (["study", "linear", "-o", "file"], "file: is not a directory", 1),
        (["study", "linear", "-o", "d", "--json", "none/a.json"], "there is no directory", 1),
    ):
        assert says in refusal(run, *arguments, status=status)
        assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_missing_extras_are_named(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    err = refusal(run, "study", "linear", "-o", tmp_path / "d", status=1)
    assert err.endswith(f"study needs matplotlib: {install('analysis,plots')}\n") and not (tmp_path / "d").exists()
