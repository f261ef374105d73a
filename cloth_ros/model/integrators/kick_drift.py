"""
The forces of a scene, as an integration method sees them.

Only what the scene has is made: a scene without air has no aerodynamics to skip.

Springs are fast and dissipation is slow: the air, or a dashpot, changes a velocity far less in a
substep than a stiff spring does.  A method may therefore let dissipation act in one substep of
several, as many times as strongly, which is multiple time stepping with impulses (M. Tuckerman,
B. J. Berne, G. J. Martyna, J. Chem. Phys. 97, 1992, section II).
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...scene import Scene
from ..forces import aerodynamics, springs
from ..grid import Array, Grid
from ..kernels.thread_pool import CHUNK, shared_thread_pool
from ..state import State
from . import kick_drift_kernel
from .integrator import Step

# Particles from which on threads pay for their start.
_WORTH_THREADS = 4096
# Tables of passes that are kept: more are used at once in no motion.
_TABLES = 64


class KickDrift:
    """
    Kicks by springs, gravity, dashpots, drag and air, and drifts.

    Drag is a rate γ, dv/dt = a − γ v, and is integrated exactly for constant a,

        v ← e^(−γ h) v + a (1 − e^(−γ h)) / γ,

    so that neither the decay nor the terminal velocity a/γ depends on the step.  Dashpots are
    taken at the velocity in the middle of the kick (the explicit midpoint rule), which a second
    evaluation of the springs pays.  So every kick is of second order at resting positions.

    Parameters
    ----------
    scene, lattice
        What acts, and on what sheet.
    wind
        Velocity of the air, m/s, shape (3,), which the caller changes; without effect in a scene
        without air.
    dtype
        numpy.float32 or numpy.float64.
    apart
        True to accelerate apart from kicks, for whoever has to look in between.
    more_drag
        Decay rate of velocity on top of the scene's, 1/s.

    Attributes
    ----------
    damped
        True if accelerations depend on velocities: there are dashpots.
    dissipative
        True if there is something that the weight of a step applies to: dashpots or air.

    """

    def __init__(
        self,
        scene: Scene,
        lattice: Grid,
        wind: Array,
        dtype: type,
        *,
        apart: bool = False,
        more_drag: float = 0.0,
    ) -> None:
        self.wind = wind
        self._apart = apart
        present = {family.name for family in springs.spring_families(scene)}
        self.damped = bool(present) and scene.springs.damping > 0
        self._air = aerodynamics.coefficient(scene) if scene.has_air else 0.0
        self.dissipative = self.damped or scene.has_air
        self._drag, self._mass = scene.drag + more_drag, scene.sheet.particle_mass
        self._dashpots = scene.springs.damping / scene.sheet.particle_mass
        many = lattice.rows * lattice.columns >= _WORTH_THREADS
        self._threads = shared_thread_pool(scene.solver.threads if many else 1)
        apart = apart or self.dissipative
        self._kernel = kick_drift_kernel.compose(
            *(name in present for name in ('structural', 'shear', 'bending')),
            self.damped,
            scene.has_air,
            apart,
            dtype is np.float64,
        )
        self._tables: dict[tuple[Step, ...], Array] = {}
        self._range = (lattice.begin, lattice.end, lattice.stride)
        self._springs = tuple(dtype(number) for number in springs.constants(scene))
        self._bounds = tuple(dtype(number) for number in aerodynamics.BOUNDS)
        # What a scene does without needs no memory, but a shape that the kernel can take.
        needless: Array = np.zeros((3, 0), dtype)
        self._facets = lattice.field(dtype, components=6) if scene.has_air else needless
        self._middle = lattice.field(dtype) if apart else needless
        self._work = np.zeros((lattice.end - lattice.begin) // CHUNK + 1)

    def carry(self, state: State, steps: tuple[Step, ...]) -> None:
        """Carry `state` through `steps`."""
        table = self._tables.get(steps)
        if table is None:
            if len(self._tables) == _TABLES:
                self._tables.clear()
            table = np.array([row for step in steps for row in self._rows(step)])
            self._tables[steps] = table
        self._make(state, table)

    def accelerate(self, state: State) -> None:
        """Write the accelerations by gravity, springs and dashpots; `apart` must be true."""
        self._make(
            state, np.array([(kick_drift_kernel.ACCELERATE, 1.0, 0.0, 0.0, self._dashpots, 0.0)])
        )

    def take_work(self) -> float:
        """Return the work of the air on what it has sped up since the last call, J."""
        work = self._mass * float(self._work.sum())
        self._work[:] = 0
        return work

    def _rows(self, step: Step) -> Iterator[tuple[float, ...]]:
        """Yield the passes of a step: kind, decay, gain, drift, dashpots, air; see `passes`."""
        h, drift, weight = step
        if h is None:
            yield (kick_drift_kernel.DRIFT, 1.0, 0.0, drift, 0.0, 0.0)
            return
        decay, gain = self._drag_of(h)
        if not self._apart and (weight == 0 or not self.dissipative):
            yield (kick_drift_kernel.KICK_BY_SPRINGS, decay, gain, drift, 0.0, 0.0)
            return
        dashpots = weight * self._dashpots
        yield (kick_drift_kernel.ACCELERATE, 1.0, 0.0, 0.0, dashpots, 0.0)
        if self._air:
            yield (kick_drift_kernel.FACETS, 1.0, 0.0, 0.0, 0.0, 0.0)
        if self.damped:
            first = self._drag_of(0.5 * h)
            yield (kick_drift_kernel.KICK_MIDDLE, *first, 0.0, 0.0, weight * first[1] * self._air)
            yield (kick_drift_kernel.ACCELERATE_MIDDLE, 1.0, 0.0, 0.0, dashpots, 0.0)
        yield (kick_drift_kernel.KICK, decay, gain, drift, 0.0, weight * gain * self._air)

    def _make(self, state: State, table: Array) -> None:
        """Make the passes of a table."""
        number = state.dtype
        self._threads.run(
            self._kernel,
            *self._range,
            table,
            state.position,
            state.other,
            state.velocity,
            self._middle,
            state.acceleration,
            self._facets,
            state.free,
            self._springs,
            tuple(map(number, self.wind)),
            self._bounds,
            self._work,
        )
        if np.count_nonzero(table[:, 0] <= kick_drift_kernel.KICK) % 2:
            state.position, state.other = state.other, state.position

    def _drag_of(self, h: float) -> tuple[float, float]:
        """Return what a kick of `h` s multiplies velocities and accelerations by, 1 and s."""
        if self._drag == 0:
            return 1.0, h
        return math.exp(-self._drag * h), -math.expm1(-self._drag * h) / self._drag
