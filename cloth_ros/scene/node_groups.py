"""Groups of parameters of the node alone, which change nothing about how a cloth moves."""

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


@dataclass(frozen=True)
class SimulationClock(ParameterGroup):
    """The topic /clock of a node that is the clock of a simulation."""

    prefix: ClassVar[str] = 'clock.'
    publish: bool = parameter(
        False, 'publish the simulated time on /clock, and stamp all messages with it', fixed=True
    )
    rate: float = parameter(
        0.0,
        'messages on /clock per second, at most one a tick; 0: one at each tick',
        unit='Hz',
        low=0,
        high=1000,
    )


@dataclass(frozen=True)
class SavedState(ParameterGroup):
    """The file of the services ~/save and ~/load."""

    prefix: ClassVar[str] = 'snapshot.'
    file: str = parameter(
        '', 'file that ~/save writes and ~/load reads; empty: cloth.snapshot in ~/.ros'
    )


# Parameters that belong to the node and not to a state that it saves.
KEPT_BY_THE_NODE = (SimulationClock.prefix, SavedState.prefix)
