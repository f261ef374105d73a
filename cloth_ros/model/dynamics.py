"""
The forces of a scene, as an integration method sees them.

Only what the scene has is made: a scene without air has no aerodynamics to skip.
"""

from __future__ import annotations

import math

from .aerodynamics import Aerodynamics
from .lattice import Array, Lattice
from .scene import Scene
from .springs import Springs
from .state import State, kick


class Dynamics:
    """
    Accelerations by springs and gravity, and the velocity change that they and the air cause.

    Attributes
    ----------
    wind
        Velocity of the air, m/s, shape (3,); without effect in a scene without air.
    damped
        True if accelerations depend on velocities: there are dashpots.

    """

    def __init__(self, scene: Scene, lattice: Lattice, wind: Array, dtype: type) -> None:
        self.wind = wind
        self._drag = scene.drag
        self._springs = Springs(scene, lattice, dtype)
        self.damped = self._springs.damped
        self._air = Aerodynamics(scene, lattice, dtype) if scene.has_air else None

    def accelerate(self, state: State) -> None:
        """Write the accelerations by springs, dashpots and gravity into `state`."""
        self._springs.accelerate(state.position, state.velocity, state.free, state.acceleration)

    def kick(self, state: State, h: float) -> None:
        """
        Change the velocities by `h` seconds of the accelerations in `state`, drag and air.

        Drag is a rate γ, dv/dt = a − γ v, and is integrated exactly for constant a,

            v ← e^(−γ h) v + a (1 − e^(−γ h)) / γ,

        so that neither the decay nor the terminal velocity a/γ depends on the step.  The whole
        kick is of second order for constant accelerations.
        """
        decay = math.exp(-self._drag * h)
        gain = -math.expm1(-self._drag * h) / self._drag if self._drag else h
        if self._air is None:
            kick(state, decay, gain)
        else:
            self._air.kick(state, decay, gain, self.wind)
