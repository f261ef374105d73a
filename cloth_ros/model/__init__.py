"""
A mass-spring cloth that knows no ROS.

`Scene` says what to simulate, `Cloth` simulates it.
"""

from .cloth import Cloth
from .energy import Energy
from .scene import Gust, Markers, Scene, Sheet, Solver, Sphere, Springs, Wind

__all__ = [
    'Cloth',
    'Energy',
    'Gust',
    'Markers',
    'Scene',
    'Sheet',
    'Solver',
    'Sphere',
    'Springs',
    'Wind',
]
