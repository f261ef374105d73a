"""
Error of an implicit method: ``python -m tools.implicit_midpoint [PAGE]``.

The implicit midpoint rule is stable for any step and of second order, as position Verlet is:

    y = x + h/2 (v + h/2 a(y)),   x ← 2 y − x,   v ← v + h a(y).

The sheet of `hanging.yaml`, with fewer particles and without air and drag, falls for 0.2 s, also
with all springs a hundred times as stiff.  Newton's method with the exact tangent stiffness solves
each step to rounding, so that what is compared is the method, whatever solves its equations.  The
solution is extrapolated from Verlet with 16 and 32 substeps in the longest stable one.  Writes a
table between its marks in PAGE (default: docs/choosing.md) and prints it.  Takes some minutes.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from scipy.sparse import identity
from scipy.sparse.linalg import spsolve

from cloth_ros import Cloth, Scene
from cloth_ros.model.grid import Array
from cloth_ros.model.time_step import stability_limit
from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.reference_model import acceleration, tributary_areas
from cloth_ros.tradeoff.tangent_stiffness import TangentStiffness
from tools.marked_block import fill

PAGE = Path('docs/choosing.md')
SECONDS = 0.2
# Particles of a side, stiffness, and lengths of implicit steps as multiples of the longest stable
# explicit one.
CASES = (
    (12, 1, (1, 2, 4, 8, 16)),
    (24, 1, (4, 8, 16)),
    (12, 100, (4, 16, 64)),
    (24, 100, (16, 64)),
)
_SAFETY = 0.9
_ITERATIONS = 20
_CONVERGED = 1e-12  # m, times the root of a mass of 1 kg


class Sheet:
    """The sheet with `side` × `side` particles and springs of `stiffness` times the scene's."""

    def __init__(self, side: int, stiffness: float) -> None:
        known = Scene.from_yaml('config/hanging.yaml')
        self.scene = known.with_parameters(
            {
                'sheet.rows': side,
                'sheet.columns': side,
                'drag': 0.0,
                'wind.air_density': 0.0,
                'springs.structural': stiffness * known.springs.structural,
                'springs.shear': stiffness * known.springs.shear,
                'springs.bending': stiffness * known.springs.bending,
            }
        )
        self.limit = stability_limit(self.scene)
        self._start = np.moveaxis(Cloth(self.scene).positions, -1, 0)
        self._free = ~self.scene.pinned()
        masses = self.scene.sheet.cell_mass * tributary_areas(side, side)
        self._roots = np.sqrt(masses[self._free])

    def _accelerate(self, positions: Array) -> Array:
        return acceleration(self.scene, positions, np.zeros_like(positions))

    def verlet(self, steps: int) -> Array:
        """Return the positions, m, shape (3, rows, columns), after so many steps."""
        h = SECONDS / steps
        x, v = self._start.copy(), np.zeros_like(self._start)
        for _ in range(steps):
            x += 0.5 * h * v
            v += h * self._accelerate(x)
            x += 0.5 * h * v
        return x

    def midpoint(self, steps: int) -> tuple[Array, float]:
        """Return the positions and the mean number of Newton iterations in a step."""
        h = SECONDS / steps
        x, v = self._start.copy(), np.zeros_like(self._start)
        iterations = 0
        for _ in range(steps):
            middle = x + 0.5 * h * v
            for _ in range(_ITERATIONS):
                lack = middle - x - 0.5 * h * v - 0.25 * h**2 * self._accelerate(middle)
                residual = (lack[:, self._free] * self._roots).ravel()
                if np.abs(residual).max() < _CONVERGED:
                    break
                stiffness = TangentStiffness(self.scene, middle).stiffness
                matrix = identity(len(residual)) + 0.25 * h**2 * stiffness
                change = spsolve(matrix.tocsc(), residual).reshape(3, -1)
                middle[:, self._free] -= change / self._roots
                iterations += 1
            v += h * self._accelerate(middle)
            x = 2 * middle - x
        return x, iterations / steps


def rows(side: int, stiffness: int, multiples: Iterable[int]) -> Iterator[list[str]]:
    """Yield the rows of a sheet, that of position Verlet first."""
    sheet = Sheet(side, stiffness)
    shortest = math.ceil(SECONDS / sheet.limit)
    coarse, fine = sheet.verlet(16 * shortest), sheet.verlet(32 * shortest)
    solution = fine + (fine - coarse) / 3

    def row(method: str, steps: int, positions: Array, iterations: str) -> list[str]:
        error = 1e3 * float(np.linalg.norm(positions - solution, axis=0).max())
        length = SECONDS / steps / sheet.limit
        return [
            f'{side} × {side}',
            f'× {stiffness}',
            method,
            f'{length:.2g}',
            iterations,
            f'{error:.2g}',
        ]

    steps = math.ceil(SECONDS / (_SAFETY * sheet.limit))
    yield row('position Verlet', steps, sheet.verlet(steps), '')
    for multiple in multiples:
        steps = max(round(SECONDS / (multiple * sheet.limit)), 1)
        positions, iterations = sheet.midpoint(steps)
        yield row('implicit midpoint', steps, positions, f'{iterations:.1f}')


def main() -> None:
    """Compute, and write the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').strip().splitlines()[0])
    parser.add_argument('page', nargs='?', type=Path, default=PAGE)
    page = parser.parse_args().page
    head = [
        'sheet',
        'stiffness',
        'method',
        'step / stability limit',
        'Newton iterations',
        'error [mm]',
    ]
    found = []
    for case in CASES:
        for row in rows(*case):
            found.append(row)
            print('  '.join(row), flush=True)
    fill(page, 'python -m tools.implicit_midpoint', table(head, found))


if __name__ == '__main__':
    main()
