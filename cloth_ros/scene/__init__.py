"""Parameters of a simulation as validated data: units, ranges, and reading ROS parameter files."""

from .collider import ColliderParameters, Colliders
from .messages import Markers, Particles
from .scene import Gust, Scene, Sheet, Solver, Sphere, Springs, Wind

__all__ = [
    'ColliderParameters',
    'Colliders',
    'Gust',
    'Markers',
    'Particles',
    'Scene',
    'Sheet',
    'Solver',
    'Sphere',
    'Springs',
    'Wind',
]
