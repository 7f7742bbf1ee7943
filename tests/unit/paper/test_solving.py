"""Trials shared by figures and claims are solved once, and each gets the same result as alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.strings import case_b

from livebass.engine.solve import solve_trial
from livebass.lab.paper.solving import Job, share_jobs, solve_all
from livebass.lab.reference.solver import solve

TRIAL = case_b(60, 192e3, 0.02, 48_000.0)


def test_jobs_that_differ_in_states_alone_are_solved_as_one() -> None:
    jobs = [Job(replace(TRIAL, states=states)) for states in ((), (0, 400, 900), (100, 400))]
    calls: list[None] = []
    solved = solve_all(jobs, 2, lambda: calls.append(None))
    assert {job.trial.states for job in share_jobs(jobs).values()} == {(0, 100, 400, 900)} and len(calls) == 1
    for job in jobs:
        alone, motion = solve_trial(job.trial), solved[job].motion
        assert solved[job].trial == job.trial and alone.contact_step.size > 0
        np.testing.assert_array_equal(motion.displacement_m, alone.displacement_m)
        np.testing.assert_array_equal(motion.contact_step, alone.contact_step)
        assert (motion.states is None) == (alone.states is None)
        if motion.states is not None and alone.states is not None:
            np.testing.assert_array_equal(motion.states, alone.states)


def test_other_trials_and_other_solvers_are_jobs_of_their_own() -> None:
    jobs = [Job(TRIAL), Job(TRIAL, solve), Job(replace(TRIAL, lossless=True)), Job(TRIAL)]
    assert len(set(share_jobs(jobs).values())) == 3
    solved = solve_all(jobs, 2)
    assert len(solved) == 3
    fast, slow = (solved[job].motion.displacement_m for job in jobs[:2])
    np.testing.assert_allclose(fast, slow, atol=1e-3 * np.abs(slow).max())
    assert solve_all([]) == {}


def test_a_solution_that_is_not_finite_is_refused() -> None:
    broken = replace(solve_trial(TRIAL), displacement_m=np.full(3, np.nan))
    with pytest.raises(ValueError, match=r"60 modes at 0\.192 MHz: the solution is not finite"):
        solve_all([Job(TRIAL, lambda trial: broken)])
