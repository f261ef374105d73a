"""Parameters of the messages that a node publishes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .parameter import ParameterGroup, parameter


@dataclass(frozen=True)
class Particles(ParameterGroup):
    """Messages with the particles."""

    prefix: ClassVar[str] = 'particles.'
    rate: float = parameter(
        0.0, 'particle messages per second; 0: one for each tick', unit='Hz', low=0, high=1000
    )
    velocities: bool = parameter(True, 'whether they have velocities, besides positions')


@dataclass(frozen=True)
class Markers(ParameterGroup):
    """Markers for RViz."""

    prefix: ClassVar[str] = 'markers.'
    rate: float = parameter(
        30.0, 'marker messages per second; 0: none', unit='Hz', low=0, high=1000
    )
    springs: bool = parameter(False, 'show the springs as lines')
    meshes: str = parameter(
        'triangles',
        'how colliders of type mesh are shown: as triangles, for every viewer; or as the URL of '
        'the file, which viewers on this machine read themselves',
        choices=('triangles', 'file'),
    )
