"""A live cloth for ROS 2; the names here are the model, which needs no ROS."""

from .model import (
    Cloth,
    Energy,
    Gust,
    Markers,
    Scene,
    Sheet,
    Solver,
    Sphere,
    Springs,
    Wind,
)

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
