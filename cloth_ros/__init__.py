"""A live cloth for ROS 2; the names here are the model, which needs no ROS."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .model import Cloth, Energy, Inputs, Snapshot
    from .scene import (
        ColliderParameters,
        Colliders,
        GripperParameters,
        Grippers,
        Gust,
        Markers,
        Particles,
        SavedState,
        Scene,
        Sheet,
        SimulationClock,
        Solver,
        Sphere,
        Springs,
        Wind,
    )

_SCENE = (
    *('ColliderParameters', 'Colliders', 'Gust', 'Markers', 'Particles', 'SavedState', 'Scene'),
    *(
        'GripperParameters',
        'Grippers',
        'Sheet',
        'SimulationClock',
        'Solver',
        'Sphere',
        'Springs',
        'Wind',
    ),
)
__all__ = [
    'Cloth',
    'ColliderParameters',
    'Colliders',
    'Energy',
    'GripperParameters',
    'Grippers',
    'Gust',
    'Inputs',
    'Markers',
    'Particles',
    'SavedState',
    'Scene',
    'Sheet',
    'SimulationClock',
    'Snapshot',
    'Solver',
    'Sphere',
    'Springs',
    'Wind',
]


def __getattr__(name: str) -> Any:
    """Import on first use: the node must be able to handle signals before the slow imports."""
    if name in _SCENE:
        from . import scene

        return getattr(scene, name)
    if name in __all__:
        from . import model

        return getattr(model, name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
