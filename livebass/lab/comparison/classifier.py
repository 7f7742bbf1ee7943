"""A logistic regression that tells notes of one kind from another by their standardised figures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from livebass.lab.comparison.groups import FIGURES, WITHOUT
from livebass.lab.comparison.measures import T60_KEYS
from livebass.rows.arrays import Floats

RATIOS = {"drift", "wobble", "t60_scatter", "centroid_20", "centroid_100", "centroid_fall", *T60_KEYS}  # as logarithms
RIDGE = 0.1  # weight of the squared coefficients against the mean loss
CLIPPED = 4.0  # standard deviations


def standard(groups: Sequence[Floats], without: str) -> list[Floats]:
    """Returns figures of groups relative to their median and spread over all; a missing one counts as the median.

    groups: (n, FIGURES) each; `without` names the figures that are left out, by a key of WITHOUT.
    """
    columns = np.array([key not in WITHOUT[without] for key in FIGURES])
    ratio = np.array([key in RATIOS for key in FIGURES])
    logs = [np.where(ratio, np.log(np.where(ratio, np.maximum(x, 1e-3), 1.0)), x)[:, columns] for x in groups]
    together = np.concatenate(logs)
    together[:, ~np.isfinite(together).any(axis=0)] = 0.0
    low, middle, high = np.nanpercentile(together, [16, 50, 84], axis=0)
    spread = np.where(high - low > 1e-9, (high - low) / 2, 1.0)
    return [np.clip(np.nan_to_num((x - middle) / spread), -CLIPPED, CLIPPED) for x in logs]


def train(rows: Floats, mine: NDArray[np.bool_], weight: Floats) -> Floats:
    """Returns weights of figures (columns,) whose sum is higher for rows (n, columns) that are `mine`.

    weight: of each row in the mean loss, (n,).
    """
    x = np.column_stack([rows, np.ones(len(rows))])
    ridge = np.append(np.full(x.shape[1] - 1, RIDGE), 1e-9)
    beta = np.zeros(x.shape[1])
    for _ in range(50):  # Newton's method
        p = 1 / (1 + np.exp(-(x @ beta)))
        slope = x.T @ (weight * (p - mine)) + ridge * beta
        step = np.linalg.solve((x.T * (weight * p * (1 - p))) @ x + np.diag(ridge), slope)
        beta -= step
        if np.abs(step).max() < 1e-6:
            break
    return np.asarray(beta[:-1])


def train_groups(mine: Sequence[Floats], others: Sequence[Floats]) -> Floats:
    """Trains on rows by group: each group weighs as much as any other of its side, both sides the same."""
    weight = [np.full(len(x), 0.5 / len(x) / len(side)) for side in (mine, others) for x in side]
    count = sum(map(len, mine))
    rows = np.concatenate([*mine, *others])
    return train(rows, np.arange(len(rows)) < count, np.concatenate(weight))


def auc(a: Floats, b: Floats, weight_a: Floats | None = None, weight_b: Floats | None = None) -> float:
    """Returns the probability that one of `a` (n,) is above one of `b` (m,); equal ones count half.

    The weights, (n,) and (m,), say how often each is asked.
    """
    above = (a[:, None] > b) + 0.5 * (a[:, None] == b)
    return float(np.average(np.average(above, axis=0, weights=weight_a), weights=weight_b))
