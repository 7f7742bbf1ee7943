"""Solves the trials of figures and claims, each once, on all cores."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace

import numpy as np

from livebass.analysis.motion import Solved
from livebass.cores import core_count
from livebass.engine.solve import solve_trial
from livebass.model.trial import Motion, Trial


@dataclass(frozen=True)
class Job:
    """A trial and the solver for it."""

    trial: Trial
    solver: Callable[[Trial], Motion] = solve_trial

    def solve(self) -> Motion:
        """Raises ValueError where the solution is not finite."""
        motion = self.solver(self.trial)
        if not np.isfinite(motion.displacement_m).all():
            trial = self.trial
            rate = f"{trial.contact_rate / 1e6:g} MHz"
            raise ValueError(f"{trial.modes} modes at {rate}: the solution is not finite; take another rate")
        return motion


def shared(jobs: Iterable[Job]) -> dict[Job, Job]:
    """For each job the one to solve in its place: those that differ in `Trial.states` alone become one with all."""
    bare = {job: replace(job, trial=replace(job.trial, states=())) for job in jobs}
    states: dict[Job, set[int]] = {}
    for job, without in bare.items():
        states.setdefault(without, set()).update(job.trial.states)
    whole = {job: replace(job, trial=replace(job.trial, states=tuple(sorted(s)))) for job, s in states.items()}
    return {job: whole[without] for job, without in bare.items()}


def solve_all(
    jobs: Iterable[Job], workers: int | None = None, step: Callable[[], None] = lambda: None
) -> dict[Job, Solved]:
    """Solve `jobs` on `workers` threads (default: as many as cores), the longest first so that no core waits.

    `step` is called after each motion; there are as many as values in `shared`. Raises ValueError where a solution is
    not finite. [main thread]
    """
    instead = shared(jobs)
    wanted = sorted(dict.fromkeys(instead.values()), key=lambda job: -job.trial.duration * job.trial.contact_rate)
    for job in {(job.solver, bool(job.trial.speaking.surface)): job for job in wanted}.values():
        instant = replace(job.trial, duration=1 / job.trial.output_rate, states=())
        job.solver(instant)  # compiles, or loads the compiled code
    motions: dict[Job, Motion] = {}
    with ThreadPoolExecutor(workers or core_count()) as pool:
        futures = {pool.submit(job.solve): job for job in wanted}
        try:
            for future in as_completed(futures):
                motions[futures[future]] = future.result()
                step()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    return {
        job: Solved(job.trial, _with_states(motions[whole], whole.trial, job.trial)) for job, whole in instead.items()
    }


def _with_states(motion: Motion, solved: Trial, asked: Trial) -> Motion:
    """`motion` of the trial `solved` with the states of the trial `asked` alone."""
    if motion.states is None or asked.states == solved.states:
        return motion
    if not asked.states:
        return replace(motion, states=None)
    return replace(motion, states=motion.states[np.searchsorted(solved.states, asked.states)])
