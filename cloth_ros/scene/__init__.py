"""Parameters of a simulation as validated data: units, ranges, and reading ROS parameter files."""

from .scene import Gust, Markers, Scene, Sheet, Solver, Sphere, Springs, Wind

__all__ = ['Gust', 'Markers', 'Scene', 'Sheet', 'Solver', 'Sphere', 'Springs', 'Wind']
