"""Parameters of a simulation as validated data: units, ranges, and reading ROS parameter files."""

from .collider import ColliderParameters, Colliders
from .gripper import GripperParameters, Grippers
from .node_groups import Markers, Particles, SavedState, SimulationClock
from .scene import Scene, Sheet, Solver, Sphere, Springs
from .wind import Gust, Wind

__all__ = [
    'ColliderParameters',
    'Colliders',
    'GripperParameters',
    'Grippers',
    'Gust',
    'Markers',
    'Particles',
    'SavedState',
    'Scene',
    'Sheet',
    'SimulationClock',
    'Solver',
    'Sphere',
    'Springs',
    'Wind',
]
