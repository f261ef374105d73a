"""
The reference solution that errors are measured against, and the time for which it is valid.

It is the solution of the integrator of highest order in double precision.  Its substeps are halved
until two levels agree ten times better than the smallest error that is reported.  A cloth is
chaotic after an impact and where it buckles: solutions diverge there at any substep, and no
reference exists.  The time until then is the *horizon*; errors are reported within it only.
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

# Smallest error / difference of two levels of the reference, at least.
_BETTER = 10.0
# Difference of two levels, m, that rounding alone may cause: small enough for any error.
_NEGLIGIBLE = 1e-9
# Strain of all springs whose energy counts as negligible.
_SLIGHT = 1e-3
# Distance at which two runs count as diverged, as a share of the sheet's diagonal.
_APART = 0.01


def reference_setting(scene: Scene, level: int) -> Setting:
    """Return the setting of the reference with `level` times the least stable substeps."""
    method = max(INTEGRATORS.values(), key=lambda candidate: candidate.order).name
    substeps = level * least_substeps(scene, method)
    return Setting(method, 'double', substeps, 1e-3, scene.rate)


def distances(positions: Array, others: Array) -> tuple[Array, Array]:
    """
    Return the distance between two runs at each sample.

    Parameters
    ----------
    positions, others
        m, shape (samples, rows, columns, 3); the longer one is cut to the other's samples.

    Returns
    -------
    (array, array)
        Largest distance of any particle, m, and mean square distance, m², shape (samples,).

    """
    samples = min(len(positions), len(others))
    squares = np.sum((positions[:samples] - others[:samples]) ** 2, axis=-1)
    return np.sqrt(squares.max(axis=(1, 2))), squares.mean(axis=(1, 2))


def time_together(largest: Array, times: Array, diagonal: float) -> float:
    """Return the time, s, until two runs differ by more than 1 % of the sheet's diagonal."""
    apart = np.nonzero(largest > _APART * diagonal)[0]
    if len(apart):
        return float(times[apart[0]])
    return float(times[len(largest) - 1]) if len(largest) else 0.0


def negligible_energy(scene: Scene) -> float:
    """Return the energy, J, of a strain of 0.1 % in every spring; less counts as none."""
    grid = np.empty((scene.sheet.rows, scene.sheet.columns))
    return sum(
        0.5
        * family.stiffness
        * (_SLIGHT * family.rest_length) ** 2
        * spring_ends(family, grid)[0].size
        for family in spring_families(scene)
    )


def blow_up_energy(reference: Run, scene: Scene) -> float:
    """
    Return the kinetic and elastic energy, J, from which on a run counts as blown up.

    Ten times the largest of the reference.
    """
    return 10 * max(*reference.motion, negligible_energy(scene))


@dataclass(frozen=True)
class Horizon:
    """
    Time for which the reference is valid.

    Attributes
    ----------
    samples
        Number of samples within it.
    agreement
        Largest distance between the two finest levels within it, m.
    smallest_error
        Smallest largest error of any setting within it, m.

    """

    samples: int
    agreement: float
    smallest_error: float


def horizon(between_levels: Array, errors: list[Array]) -> Horizon:
    """
    Return the longest time within which the reference is accurate enough for every setting.

    Parameters
    ----------
    between_levels
        Largest distance between the two finest levels at each sample, m, shape (samples,).
    errors
        Largest distance of each stable setting from the reference at each sample, m.

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
    Return the record of a setting with its errors within the horizon in place of its samples.

    Parameters
    ----------
    entry
        Record with `largest` and `square` distance from the reference, `energy` and `stretch` at
        each sample, and `unstable`.
    reference, limit
        Reference solution and the time for which it is valid.
    times
        Of the samples, s, shape (samples,).
    scene
        Its sheet, whose diagonal relative errors refer to, and its springs.

    """
    entry, diagonal = dict(entry), scene.sheet.diagonal
    largest, square = np.array(entry.pop('largest')), np.array(entry.pop('square'))
    energy, stretch = np.array(entry.pop('energy')), np.array(entry.pop('stretch'))
    n = limit.samples
    entry['together'] = time_together(largest, times, diagonal)
    entry['error'] = None
    if entry['unstable'] or n == 0:
        return entry
    turnover = max(*reference.motion[:n], negligible_energy(scene))
    drift = np.abs(energy[:n] - np.array(reference.energy[:n])).max()
    entry['error'] = {
        'largest': float(largest[:n].max()),
        'rms': float(np.sqrt(square[:n].mean())),
        'largest of the sheet': float(largest[:n].max()) / diagonal,
        'rms of the sheet': float(np.sqrt(square[:n].mean())) / diagonal,
        'stretch': float(np.abs(stretch[:n] - np.array(reference.stretch[:n])).max()),
        'energy': float(drift) / turnover,
    }
    return entry
