"""Parts of a batch of substeps, for each of which the triangles of the sheet are measured."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from ..grid import Array
from .interfaces import Drift

# Length of a part of several steps, s, at most.
LONGEST = 1 / 120
# Relative rounding of durations.
_ROUNDING = 1e-6


class Part(NamedTuple):
    """Steps of a part, and their duration, s."""

    steps: tuple[Drift, ...]
    seconds: float


class BatchParts(NamedTuple):
    """
    A batch in parts.

    Attributes
    ----------
    steps
        All steps of the batch.
    times
        Its start and the end of each drift, s from the start.
    parts
        Nearly equal ones.

    """

    steps: tuple[Drift, ...]
    times: Array
    parts: list[Part]


def parts_of(steps: tuple[Drift, ...]) -> BatchParts:
    """Return a batch in parts that are not longer than `LONGEST`, or of one step."""
    times = np.cumsum([0.0, *[step.drift for step in steps]])
    count = max(min(math.ceil(times[-1] / LONGEST * (1 - _ROUNDING)), len(steps)), 1)
    ends = [math.ceil(len(steps) * n / count) for n in range(count + 1)]
    parts = [
        Part(steps[first:last], float(times[last] - times[first]))
        for first, last in itertools.pairwise(ends)
    ]
    return BatchParts(steps, times, parts)
