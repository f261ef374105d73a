"""
Energy budget of a cloth: the work of each force beside the energy that the cloth gained.

Kinetic and elastic energy change by the work of gravity, air, drag, dashpots and contact, and by
nothing else; the difference is the error of the integration.

An impulse J in a substep that changes the velocity of a particle from v to v' does the work
J·(v + v')/2.  The impulses of air, drag and dashpots are computed here from their laws at the
mean velocity, by the reference implementation, and so are independent of the compiled kernels, as
is the potential of springs and gravity; an error in any of them leaves the budget open.  The
impulse of contact is the change of velocity in contact, booked but not checked.  Contact also
displaces particles out of a collider without giving them the velocity; this displacement against
springs and gravity is work of contact as well.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from ..model import Cloth
from ..model.energy import Energy, energy
from ..model.grid import Array
from ..model.inputs import Vector
from ..model.integrators.dashpot_stages import stages_for
from ..model.integrators.integrator import Step
from ..model.stability import rate_bounds
from ..model.state import State
from ..scene import Scene
from .reference_model import air_forces, spring_forces, tributary_areas
from .reference_solution import negligible_energy


@dataclass(frozen=True)
class Budget:
    """
    Energy by its source, J.

    Attributes
    ----------
    motion
        Kinetic and elastic energy gained.
    gravity, air, drag, dashpots, contact
        Work done on the cloth.
    turnover
        Largest absolute work of any of these at any time, and at least the energy that counts as
        negligible.

    """

    motion: float
    gravity: float
    air: float
    drag: float
    dashpots: float
    contact: float
    turnover: float

    @property
    def unexplained(self) -> float:
        """Energy that the integration has produced or lost, J."""
        work = self.gravity + self.air + self.drag + self.dashpots + self.contact
        return self.motion - work

    @property
    def closure(self) -> float:
        """Unexplained energy as a share of the turnover."""
        return abs(self.unexplained) / self.turnover

    def as_dict(self) -> dict[str, float]:
        """Return all of it by name."""
        return {**asdict(self), 'unexplained': self.unexplained, 'closure': self.closure}


class WorkAccount:
    """
    Substep observer that books the work done on a cloth.

    Pass it to `Cloth` as `observer`, without an energy monitor: the work of a batch of substeps
    that is rolled back would be booked twice.  `open` begins the account.

    Parameters
    ----------
    scene
        Its masses and forces.

    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._free = ~scene.pinned()
        # kg, shape (rows, columns).
        self._masses = scene.sheet.cell_mass * tributary_areas(*self._free.shape)
        self._work = dict.fromkeys(('air', 'drag', 'dashpots', 'contact'), 0.0)
        self._turnover = 0.0

    def open(self, cloth: Cloth) -> None:
        """Begin the account with the present state of the cloth."""
        self._work = dict.fromkeys(self._work, 0.0)
        self._turnover = negligible_energy(self._scene)
        self._positions = np.moveaxis(cloth.positions, -1, 0)
        self._velocities = np.moveaxis(cloth.velocities, -1, 0)
        self._opening = self._energy()
        # Displacement since the last kick that belongs to it, and where contact caused some of it.
        self._before = np.zeros_like(self._velocities)
        self._displaced = np.zeros(self._free.shape, bool)

    def after_drift(self, state: State, step: Step, air_velocity: Vector) -> None:
        """Compute the impulses of a kick at the positions before the drift that follows it."""
        self._drifted, self._kicked = state.world_positions, state.velocities
        self._kick = 0.0 if step.kick is None else step.kick
        self._impulses: dict[str, Array] = {}
        if step.kick is None:
            return
        scene, h, positions = self._scene, step.kick, self._positions
        mean = 0.5 * (self._velocities + self._kicked)
        self._impulses['drag'] = -self._masses * scene.drag * h * mean
        if scene.springs.damping > 0 and step.weight:
            self._impulses['dashpots'] = self._dashpot_impulse(step.weight * h, h)
        if scene.has_air and step.weight:
            air = air_forces(scene, positions, mean, air_velocity)
            self._impulses['air'] = step.weight * h * air * self._free

    def after_contact(self, state: State, step: Step) -> None:
        """Book the last kick, if there was one, and the drift and the contact after it."""
        positions, velocities = state.world_positions, state.velocities
        self._impulses['contact'] = self._masses * (velocities - self._kicked)
        mean = 0.5 * (self._velocities + velocities)
        for name, impulse in self._impulses.items():
            self._work[name] += float(np.sum(impulse * mean))
        # A kick changes velocities in the middle of the time that it stands for: up to half of it
        # belongs to the drift after it, the rest to the drift before.
        share = min(0.5 * self._kick / step.drift, 1.0)
        displacement = positions - self._positions
        displaced = np.any(positions != self._drifted, axis=0) | np.any(
            velocities != self._kicked, axis=0
        )
        affected = displaced | self._displaced
        if share and affected.any():
            missed = self._kick * mean - self._before - share * displacement
            self._work['contact'] += float(np.sum((self._force() * missed)[:, affected]))
        self._before, self._displaced = (1 - share) * displacement, displaced
        self._positions, self._velocities = positions, velocities
        self._turnover = max(self._turnover, *map(abs, (self._gravity(), *self._work.values())))

    def _dashpot_impulse(self, seconds: float, kick: float) -> Array:
        """Return the impulse, N s, of dashpots for some s, in the middle of a kick of `kick` s."""
        scene, still = self._scene, np.zeros_like(self._positions)
        accelerated = self._free / self._masses
        start = self._velocities + 0.5 * kick * accelerated * self._force()
        elastic = spring_forces(scene, self._positions, still)
        _, viscous = rate_bounds(scene)

        def damped(velocities: Array) -> Array:
            forces = spring_forces(scene, self._positions, velocities) - elastic
            change: Array = seconds * accelerated * forces
            return change

        slowed: float = np.exp(-0.5 * scene.drag * seconds)
        change: Array = stages_for(seconds * viscous).change(start, damped)
        return slowed * self._masses * change

    def _force(self) -> Array:
        """Return the force of springs and gravity at the positions of the last kick, N."""
        still = np.zeros_like(self._positions)
        force = spring_forces(self._scene, self._positions, still)
        force += self._masses * np.array(self._scene.gravity)[:, None, None]
        masked: Array = force * self._free
        return masked

    def _energy(self) -> Energy:
        return energy(self._positions, self._velocities, self._scene)

    def _gravity(self) -> float:
        """Return the work of gravity since the account was opened, J."""
        gravity = np.array(self._scene.gravity)
        fallen = float(gravity @ (self._masses * self._positions).sum(axis=(1, 2)))
        return fallen + self._opening.gravitational

    def budget(self) -> Budget:
        """Return the budget since the account was opened."""
        return Budget(
            motion=self._energy().motion - self._opening.motion,
            gravity=self._gravity(),
            turnover=self._turnover,
            **self._work,
        )
