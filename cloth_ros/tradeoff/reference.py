"""
The reference that errors are measured against, and how far it can be trusted.

It is the solution of the most accurate method in double precision.  Its substeps are halved until
two levels agree ten times better than the smallest error that is reported.  A cloth after an
impact, or one that buckles, is chaotic: two levels part there however fine they are, and no
reference exists.  The time until then is the *horizon*, and errors are reported within it only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..model.forces.springs import spring_ends, spring_families
from ..model.grid import Array
from ..model.integrators import INTEGRATORS
from ..scene import Scene
from .run import Run
from .settings import Setting, least_substeps

# How much better than the smallest error two levels of the reference must agree.
_BETTER = 10.0
# Agreement, m, that is good enough whatever the errors: that of rounding.
_NEGLIGIBLE = 1e-9
# Strain below which a spring has no energy to speak of.
_SLIGHT = 1e-3
# Distance, as a share of the sheet's diagonal, from which on two runs are no longer together.
_APART = 0.01


def reference_setting(scene: Scene, level: int) -> Setting:
    """Return the setting of the reference with `level` times the least stable substeps."""
    method = max(INTEGRATORS.values(), key=lambda candidate: candidate.order).name
    substeps = level * least_substeps(scene, method)
    return Setting(method, 'double', substeps, 1e-3, scene.rate)


def distances(positions: Array, others: Array) -> tuple[Array, Array]:
    """
    Return how far two runs are apart at each sample.

    Parameters
    ----------
    positions, others
        m, shape (samples, rows, columns, 3); the shorter one counts.

    Returns
    -------
    (array, array)
        Largest distance of any particle, m, and mean square distance, m², shape (samples,).

    """
    samples = min(len(positions), len(others))
    squares = np.sum((positions[:samples] - others[:samples]) ** 2, axis=-1)
    return np.sqrt(squares.max(axis=(1, 2))), squares.mean(axis=(1, 2))


def time_together(largest: Array, times: Array, diagonal: float) -> float:
    """Return the time, s, until two runs are apart by 1 % of the sheet's diagonal."""
    apart = np.nonzero(largest > _APART * diagonal)[0]
    if len(apart):
        return float(times[apart[0]])
    return float(times[len(largest) - 1]) if len(largest) else 0.0


def slightest_energy(scene: Scene) -> float:
    """Return the energy of a strain of 0.1 % in every spring, J: less counts as none."""
    grid = np.empty((scene.sheet.rows, scene.sheet.columns))
    return sum(
        0.5
        * family.stiffness
        * (_SLIGHT * family.rest_length) ** 2
        * spring_ends(family, grid)[0].size
        for family in spring_families(scene)
    )


def wildest(reference: Run, scene: Scene) -> float:
    """
    Return the kinetic and elastic energy, J, that is taken for that of a run that has blown up.

    It is ten times what the reference had at its wildest.
    """
    return 10 * max(*reference.motion, slightest_energy(scene))


@dataclass(frozen=True)
class Horizon:
    """
    How far the reference goes.

    Attributes
    ----------
    samples
        Number of samples within it.
    agreement
        Largest distance of its two finest levels within it, m.
    smallest_error
        Of all settings that are compared, within it, m.

    """

    samples: int
    agreement: float
    smallest_error: float


def horizon(between_levels: Array, errors: list[Array]) -> Horizon:
    """
    Return the longest time within which the reference is good enough for every setting.

    Parameters
    ----------
    between_levels
        Largest distance between the two finest levels at each sample, m, shape (samples,).
    errors
        The same between each stable setting and the reference.

    """
    agreement = np.maximum.accumulate(between_levels)
    smallest = np.min([np.maximum.accumulate(error) for error in errors], axis=0)
    good = agreement <= np.maximum(smallest / _BETTER, _NEGLIGIBLE)
    samples = len(good) if good.all() else int(np.argmin(good))
    last = max(samples - 1, 0)
    return Horizon(samples, float(agreement[last]), float(smallest[last]))


def judge(
    entry: dict[str, Any], reference: Run, limit: Horizon, times: Array, scene: Scene
) -> dict[str, Any]:
    """
    Return the record of a setting with its errors within the horizon for its samples.

    Parameters
    ----------
    entry
        Record with `largest` and `square` distance from the reference, `energy` and `strain` at
        each sample, and `unstable`.
    reference, limit
        What it is compared with, and for how long.
    times
        Of the samples, s, shape (samples,).
    scene
        Its sheet gives the measure of lengths.

    """
    entry, diagonal = dict(entry), scene.sheet.diagonal
    largest, square = np.array(entry.pop('largest')), np.array(entry.pop('square'))
    energy, strain = np.array(entry.pop('energy')), np.array(entry.pop('strain'))
    n = limit.samples
    entry['together'] = time_together(largest, times, diagonal)
    entry['error'] = None
    if entry['unstable'] or n == 0:
        return entry
    turnover = max(*reference.motion[:n], slightest_energy(scene))
    drift = np.abs(energy[:n] - np.array(reference.energy[:n])).max()
    entry['error'] = {
        'largest': float(largest[:n].max()),
        'rms': float(np.sqrt(square[:n].mean())),
        'largest of the sheet': float(largest[:n].max()) / diagonal,
        'rms of the sheet': float(np.sqrt(square[:n].mean())) / diagonal,
        'strain': float(np.abs(strain[:n] - np.array(reference.strain[:n])).max()),
        'energy': float(drift) / turnover,
    }
    return entry
