"""A live cloth for ROS 2; the names here are the model, which needs no ROS."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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


def __getattr__(name: str) -> Any:
    """Import the model when it is first asked for: the node must heed signals before that."""
    if name in __all__:
        from . import model

        return getattr(model, name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
