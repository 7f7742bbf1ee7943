"""Solves the trials of figures and claims, each once, on all cores."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace

import numpy as np

from livebass.engine.solve import solve_trial
from livebass.lab.analysis.motion import Solved
from livebass.model.trial import Motion, Trial
from livebass.system.cores import core_count


@dataclass(frozen=True)
class Job:
    """A trial and the solver for it."""

    trial: Trial
    solver: Callable[[Trial], Motion] = solve_trial

    def solve(self) -> Motion:
        """Raises ValueError if the solution is not finite."""
        motion = self.solver(self.trial)
        if not np.isfinite(motion.displacement_m).all():
            trial = self.trial
            rate = f"{trial.contact_rate / 1e6:g} MHz"
            raise ValueError(f"{trial.modes} modes at {rate}: the solution is not finite; take another rate")
        return motion


def share_jobs(jobs: Iterable[Job]) -> dict[Job, Job]:
    """The job to solve for each job: jobs that differ only in `Trial.states` become one with all states."""
    bare = {job: replace(job, trial=replace(job.trial, states=())) for job in jobs}
    states: dict[Job, set[int]] = {}
    for job, without in bare.items():
        states.setdefault(without, set()).update(job.trial.states)
    whole = {job: replace(job, trial=replace(job.trial, states=tuple(sorted(s)))) for job, s in states.items()}
    return {job: whole[without] for job, without in bare.items()}


def solve_all(
    jobs: Iterable[Job], workers: int | None = None, step: Callable[[], None] = lambda: None
) -> dict[Job, Solved]:
    """Solve `jobs` on `workers` threads (default: one per core), the longest first so that no core waits.

    `step` is called after each motion, once per distinct value of `share_jobs`. Raises ValueError if a solution is not
    finite. [main thread]
    """
    return next(solve_in_turn([jobs], workers, step))


def solve_in_turn(
    groups: Iterable[Iterable[Job]], workers: int | None = None, step: Callable[[], None] = lambda: None
) -> Generator[dict[Job, Solved]]:
    """Solve the jobs of each group as in `solve_all`, shared ones once; yields a group when it is solved.

    The next groups are solved meanwhile. Closing the iterator starts no further motion. [main thread]
    """
    requested = [list(group) for group in groups]
    instead = share_jobs(job for group in requested for job in group)
    ordered = [
        sorted((instead[job] for job in group), key=lambda job: -job.trial.duration * job.trial.contact_rate)
        for group in requested
    ]
    wanted = dict.fromkeys(job for group in ordered for job in group)
    for job in {(job.solver, bool(job.trial.speaking.surface)): job for job in wanted}.values():
        instant = replace(job.trial, duration=1 / job.trial.output_rate, states=())
        job.solver(instant)  # compiles, or loads compiled code
    motions: dict[Job, Motion] = {}
    with ThreadPoolExecutor(workers or core_count()) as pool:
        futures = {job: pool.submit(job.solve) for job in wanted}
        try:
            for group in requested:
                missing = {futures[instead[job]]: instead[job] for job in group if instead[job] not in motions}
                for future in as_completed(missing):
                    motions[missing[future]] = future.result()
                    step()
                yield {job: Solved(job.trial, _with_states(motions[instead[job]], instead[job].trial, job.trial))
                       for job in group}  # fmt: skip
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def _with_states(motion: Motion, solved: Trial, requested: Trial) -> Motion:
    """`motion` of the trial `solved` with only the states of the trial `requested`."""
    if motion.states is None or requested.states == solved.states:
        return motion
    if not requested.states:
        return replace(motion, states=None)
    return replace(motion, states=motion.states[np.searchsorted(solved.states, requested.states)])
