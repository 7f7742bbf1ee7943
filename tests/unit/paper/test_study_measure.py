"""The measurements of studies, against the paper and against closed forms."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from livebass.engine.solve import solve_trial
from livebass.lab.analysis.motion import Solved, decay_rates
from livebass.lab.paper.claims import check
from livebass.lab.paper.figures import measure
from livebass.lab.paper.figures.section_4 import convergence_jobs, errors
from livebass.lab.paper.figures.sections_2_3 import linear
from livebass.lab.paper.figures.studies import STUDIES, choose_studies, statement_jobs, statements
from livebass.lab.paper.solving import solve_all
from livebass.model import modes
from livebass.model.trial import Motion


@pytest.fixture(scope="module")
def case_b() -> Solved:
    """0.15 s of case B: all its contacts, and some free motion."""
    trial = measure.case_job("b", 0.15).trial
    return Solved(trial, solve_trial(trial))


def test_case_b_in_numbers(case_b: Solved) -> None:
    reported = measure.numbers(case_b)
    assert reported["first_fret"] == 12 and reported["points_first_set"] == 12
    assert reported["first_contact_ms"] == pytest.approx(4, abs=0.3)
    table = measure.sets_table({"B": case_b})
    assert table.rows[0][-1] == "1-12" and table.rows[1][-1] == "2-11"  # section 4.1.1
    time_s, change = measure.variation(case_b)
    early, late = change[time_s < 0.02], change[time_s > 0.1]
    assert early.max() > 0.1 and np.abs(late).max() < 0.03  # the glide of figure 7a
    window = measure.set_times([case_b], 0)
    assert window is not None and window[0] < reported["first_contact_ms"] * 1e-3 < window[1]
    assert measure.set_times([case_b], 99) is None


def test_the_pitch_is_that_of_the_contacts(case_b: Solved) -> None:
    """A string that returns to the neck every 9.6 ms has 105 Hz, whatever its overtones; it ends in mode 1."""
    pitch = case_b.pitch
    middles = [(first + last) / 2 for first, last, _ in measure.sets_of(case_b)[:7]]
    for before, after in pairwise(middles):
        found = np.interp((before + after) / 2, pitch.time_s, pitch.frequency_hz)
        assert found == pytest.approx(1 / (after - before), rel=0.045)
    first = modes.frequencies(case_b.speaking, 1)[0]
    np.testing.assert_allclose(pitch.frequency_hz[pitch.time_s > 0.11], first, rtol=5e-3)


def test_energy_falls_and_modes_ring_down_as_damped(case_b: Solved) -> None:
    time_s, each, total = case_b.energies()
    assert each.shape == (time_s.size, 862) and time_s[0] == 0 and time_s[-1] == pytest.approx(0.15, abs=1e-4)
    assert (np.diff(total) < 0).all()
    free = time_s > case_b.contacts.time_s[-1]
    s, tested = case_b.speaking, [0, 2, 7, 20]
    sigma = decay_rates(time_s[free], each[free][:, tested])
    np.testing.assert_allclose(sigma, modes.dampings(s, 21)[tested], rtol=0.02)


def test_convergence_meets_the_paper_s_criterion() -> None:
    """Section 4: below 0.1 at 8 MHz in case B, 16 MHz in case C; and finer is better."""
    jobs = convergence_jobs(None)
    motions = solve_all(jobs[key] for key in ("b", "b 2", "b 8", "c", "c 16", "modes", "modes 400"))
    solved = {key: motions[job] for key, job in jobs.items() if job in motions}
    error = {key: errors(solved[key], solved[key.split()[0]])[0][-1] for key in solved if " " in key}
    assert error["b 8"] < 0.01 and error["c 16"] < 0.1 and error["modes 400"] < 0.1
    assert error["b 8"] < error["b 2"] < 1


def test_over_a_board_places_are_told() -> None:
    trial = measure.case_job("fretless", 0.05).trial
    solved = Solved(trial, solve_trial(trial))
    reported, table = measure.numbers(solved), measure.sets_table({"F": solved})
    assert solved.over_board and reported["first_fret"] is None and 300 < reported["first_place_mm"] < 600
    assert reported["points_first_set"] > 100  # a fretted neck has 20
    minimum, maximum = map(float, str(table.rows[0][-1]).removesuffix(" mm").split(" to "))
    assert 0 < minimum < reported["first_place_mm"] <= maximum < 604
    assert solved.contact_place.shape == solved.contacts.time_s.shape


def test_statements_beside_what_comes_out(monkeypatch: pytest.MonkeyPatch) -> None:
    few = check.choose_claims(["g-inharmonicity", "a-centroid", "g-fundamental"])
    monkeypatch.setattr(check, "PLUCKS", 2)
    monkeypatch.setattr(check, "choose_claims", lambda: few)
    jobs = statement_jobs(0.1)
    assert list(jobs) == ["a"] and jobs["a"].trial.duration == 1.0  # the paper's, whatever is requested
    motions = solve_all(jobs.values())
    found = statements({name: motions[job] for name, job in jobs.items()})
    table, inputs = found.tables
    assert [(row[0], row[-1]) for row in table.rows] == [("g-inharmonicity", "yes"), ("a-centroid", "yes")]
    assert [(row[0], row[-1]) for row in inputs.rows] == [("g-fundamental", "yes")]
    assert [claim["passed"] for claim in found.numbers["claims"]] == [True, True, True]
    assert "2 of 2" in found.numbers["verdict"]


def test_the_neck_explains_the_quality_factors() -> None:
    """Section 3.2: only with the mobility does the model follow the measured dampings."""
    found = linear({})
    measured, with_neck, without = (found.arrays[k] for k in ("measured_q", "model_q", "model_q_without_neck"))
    misses = [np.median(np.abs(q / measured - 1)) for q in (with_neck, without)]
    assert misses[0] < 0.2 and misses[1] > 0.5 and (without >= with_neck).all()


def test_the_rest_of_what_is_said() -> None:
    assert measure.ranges([1, 2, 3, 7, 9, 10]) == "1-3, 7, 9-10" and measure.ranges([]) == ""
    assert [s.name for s in choose_studies(["ALL"])] == list(STUDIES)
    assert [s.name for s in choose_studies(["neck", "b", "B"])] == ["b", "neck"]
    with pytest.raises(ValueError, match="there is no v"):
        Solved(measure.case_job("a", 0.1).trial, _still()).displacement(across=True)


def _still() -> Motion:
    nothing = np.zeros(0, np.int64)
    return Motion(np.zeros(1), np.zeros(1), nothing, nothing, 8e6, 0.0)
