"""
Explicit integrators, one per file; see `integrator.Integrator` for their interface.

To add one, write its file, name its class here, and its name in `cloth_ros.scene.scene`.
"""

from .integrator import Integrator
from .position_verlet import PositionVerlet

INTEGRATORS: dict[str, type[Integrator]] = {PositionVerlet.name: PositionVerlet}

__all__ = ['INTEGRATORS', 'Integrator', 'PositionVerlet']
