"""
Where the energy of a cloth comes from and goes to.

Kinetic and elastic energy change by the work of gravity, of air, of drag, of dashpots and of
contact, and by nothing else; what does not add up is the error of the integration.

An impulse J in a substep that takes a particle from the velocity v to v' does the work
J·(v + v')/2.  The impulses of air, drag and dashpots are computed here from their laws at the
mean velocity, independently of the kernels, and so is the potential of springs and gravity; an
error in any of them is left unexplained.  The impulse of contact is what contact has changed, and
is told apart but not checked.  Contact also moves particles, without velocity, out of the
sphere: by how much the way of a particle differs from its velocity, so much work contact does
against springs and gravity.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from ..model import Cloth
from ..model.grid import Array
from ..model.integrators.integrator import Step, SubstepBatch
from ..model.integrators.kick_drift import KickDrift
from ..model.state import State
from ..model.time_step import integrator_for
from ..scene import Scene
from .reference import slightest_energy

# Relative difference by which a drift in single precision may miss position plus velocity.
_ROUNDING = 1e-6
_DEGENERATE = 1e-300  # m², area below which a triangle has no normal


@dataclass(frozen=True)
class Budget:
    """
    Energy by where it came from, J.

    Attributes
    ----------
    motion
        Kinetic and elastic energy gained.
    gravity, air, drag, dashpots, contact
        Work done on the cloth.
    turnover
        The largest that any of these has been, and no less than counts at all.

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
        """What the integration has made or lost, J."""
        work = self.gravity + self.air + self.drag + self.dashpots + self.contact
        return self.motion - work

    @property
    def closure(self) -> float:
        """The unexplained as a share of the turnover."""
        return abs(self.unexplained) / self.turnover

    def as_dict(self) -> dict[str, float]:
        """Return all of it by name."""
        return {**asdict(self), 'unexplained': self.unexplained, 'closure': self.closure}


def air_force(positions: Array, flow: Array, scene: Scene) -> Array:
    """
    Return the force of the air on each particle, N, shape (3, rows, columns).

    Parameters
    ----------
    positions
        m, shape (3, rows, columns).
    flow
        Velocity of the air relative to each particle, m/s, of the same shape.
    scene
        Its air.

    """
    force = np.zeros_like(positions)
    near, right, down, far = (
        np.s_[:, rows, columns]
        for rows in (np.s_[:-1], np.s_[1:])
        for columns in (np.s_[:-1], np.s_[1:])
    )
    speed = np.linalg.norm(flow, axis=0)
    density = scene.wind.air_density * scene.wind.drag_coefficient / 2
    for corners in ((near, right, down), (far, down, right)):
        a, b, c = (positions[corner] for corner in corners)
        area = np.cross(b - a, c - a, axis=0) / 2
        normal = area / np.maximum(np.linalg.norm(area, axis=0), _DEGENERATE)
        for corner in corners:
            pressure = density * speed[corner[1:]] * np.sum(flow[corner] * normal, axis=0)
            force[corner] += pressure / 3 * area
    return force


class _Heard:
    """
    A `Dynamics` that remembers the last kick, and where the particles set out from.

    Attributes
    ----------
    length, weight
        Of the kick, s and 1; 0 if there was none since they were set to that.
    start, kicked
        Positions, m, and velocities, m/s, at the start of the last drift, shape (3, size).

    """

    def __init__(self, kick_drift: KickDrift) -> None:
        self._kick_drift = kick_drift
        self.length, self.weight = 0.0, 0
        self.start = self.kicked = np.zeros(0)

    def carry(self, state: State, steps: tuple[Step, ...]) -> None:
        for step in steps:
            if step.kick is not None:
                self._kick_drift.carry(state, (step._replace(drift=0.0),))
                self.length, self.weight = step.kick, step.weight
            self.start, self.kicked = state.position.copy(), state.velocity.copy()
            self._kick_drift.carry(state, (Step(None, step.drift),))


class AccountedCloth(Cloth):
    """A cloth that keeps account of the work done on it."""

    monitored = False  # what is repeated would be booked twice

    def __init__(self, scene: Scene) -> None:
        self._work = dict.fromkeys(('air', 'drag', 'dashpots', 'contact'), 0.0)
        self._turnover = 0.0
        super().__init__(scene)
        self.open()

    def _build(self, scene: Scene) -> None:
        super()._build(scene)
        self._heard = _Heard(self._kick_drift)
        self._method = integrator_for(scene)(self._heard)  # type: ignore[arg-type]
        self._forces = KickDrift(scene, self._grid_layout, self._air, np.float64, apart=True)
        self._still = State(self._grid_layout, np.float64)
        self._still.pin(scene.pinned())

    def open(self) -> None:
        """Begin the account with the present state."""
        self._work = dict.fromkeys(self._work, 0.0)
        self._turnover = slightest_energy(self.scene)
        self._opening = self.energy_by_kind()
        self._velocity = self._velocities()
        self._before = np.zeros_like(self._velocity)
        self._corrected = np.zeros(self._velocity.shape, bool)

    def _velocities(self) -> Array:
        return self._state.speeds

    def _acceleration(self, positions: Array, velocity: Array | float = 0.0) -> Array:
        """Return what springs, dashpots and gravity do at `positions`, m/s²."""
        grid, still = self._grid_layout.grid, self._still
        grid(still.position)[...] = positions - self._state.origin[:, None, None]
        grid(still.velocity)[...] = velocity
        self._forces.accelerate(still)
        return grid(still.acceleration).copy()

    def _impulses(self, positions: Array, after: Array) -> dict[str, Array]:
        """Return what air, drag and dashpots gave to each particle in the last kick, N·s."""
        before, h, weight = self._velocity, self._heard.length, self._heard.weight
        mean, scene = 0.5 * (before + after), self.scene
        mass = scene.sheet.particle_mass
        potential = self._acceleration(positions)
        self._force = mass * potential
        dashpots = np.zeros_like(mean)
        if self._forces.damped:
            dashpots = weight * mass * h * (self._acceleration(positions, mean) - potential)
        air = np.zeros_like(mean)
        if scene.has_air:
            air = weight * h * air_force(positions, self._air[:, None, None] - mean, scene)
            air *= ~scene.pinned()
        return {'drag': -mass * scene.drag * h * mean, 'dashpots': dashpots, 'air': air}

    def _book(self, impulses: dict[str, Array], way: Array, h: float, corrected: Array) -> None:
        """
        Book a kick, if there was one since the last drift, and the drift after it.

        Parameters
        ----------
        impulses
            N·s, shape (3, rows, columns).
        way
            Of the particles in the drift, m, shape (3, rows, columns).
        h
            Length of the drift, s: up to half a kick of it belongs to the kick before, and the
            rest to the one after.
        corrected
            Where the way is not by their velocity, bool.

        """
        now = self._velocities()
        mean = 0.5 * (self._velocity + now)
        for name, impulse in impulses.items():
            self._work[name] += float(np.sum(impulse * mean))
        share = min(0.5 * self._heard.length / h, 1.0)
        here = corrected | self._corrected
        if share and here.any():
            missed = self._heard.length * mean - self._before - share * way
            self._work['contact'] += float(np.sum((self._force * missed)[here]))
        self._velocity, self._before, self._corrected = now, (1 - share) * way, corrected
        self._heard.length, self._heard.weight = 0.0, 0

    def _watched(self, block: SubstepBatch) -> bool:
        return True

    def _moved(self, h: float) -> None:
        grid = self._grid_layout.grid
        start = grid(self._heard.start) + self._state.origin[:, None, None]
        kicked = grid(self._heard.kicked).astype(float)
        impulses = self._impulses(start, kicked)
        super()._moved(h)
        impulses['contact'] = self.scene.sheet.particle_mass * (self._velocities() - kicked)
        way = self._state.world - start
        missed = np.abs(way - h * self._velocities()) > _ROUNDING * (1 + np.abs(start))
        self._book(impulses, way, h, missed)

    def advance(self, seconds: float) -> None:
        """Advance, and book what is done."""
        super().advance(seconds)
        budget = self.budget()
        self._turnover = max(
            self._turnover, *(abs(value) for value in (budget.gravity, *self._work.values()))
        )

    def budget(self) -> Budget:
        """Return the account since it was opened."""
        now, then = self.energy_by_kind(), self._opening
        return Budget(
            motion=now.kinetic + now.elastic - then.kinetic - then.elastic,
            gravity=then.gravitational - now.gravitational,
            turnover=self._turnover,
            **self._work,
        )
