"""Parameters of a simulation as validated data: units, ranges, and reading ROS parameter files."""

from .collider import ColliderParameters, Colliders
from .scene import Gust, Markers, Particles, Scene, Sheet, Solver, Sphere, Springs, Wind

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
