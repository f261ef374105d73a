"""
Parameters of a simulation: a tree of frozen dataclasses, nested like the ROS parameters.

A scene is data.  Types, ranges and the agreement of fields are checked while it is made; checks
that need physics or memory (`cloth_ros.model.check_scene`) are made where a cloth is.
"""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from . import parameter_file
from .collider import ColliderParameters, Colliders
from .conversion import unit_vector
from .gripper import GripperParameters, Grippers
from .named_group import NamedGroup, check_distinct
from .node_groups import Markers, Particles, SavedState, SimulationClock
from .parameter import ParameterGroup, invalid_value_error, parameter, register
from .particle_selection import pinned_particles
from .quaternion import IDENTITY, Quaternion
from .self_contact import SelfContactParameters
from .wind import Wind

Vector = tuple[float, float, float]

# Integration methods that a scene may name; `cloth_ros.model.integrators` has one class for each.
INTEGRATOR_NAMES = ('position_verlet',)


@dataclass(frozen=True)
class Sheet(ParameterGroup):
    """The undeformed sheet: a grid of particles of equal mass."""

    prefix: ClassVar[str] = 'sheet.'
    rows: int = parameter(32, 'particles along y', low=1, high=1024, fixed=True)
    columns: int = parameter(32, 'particles along x', low=1, high=1024, fixed=True)
    size: tuple[float, float] = parameter(
        (1.0, 1.0),
        'length along the columns (x) and along the rows (y)',
        unit='m',
        low=1e-3,
        high=1e3,
        fixed=True,
    )
    mass: float = parameter(0.2, 'mass of the whole sheet', unit='kg', low=1e-9, high=1e9)
    position: Vector = parameter(
        (0.0, 0.0, 1.0), 'centre', unit='m', low=-1e6, high=1e6, fixed=True
    )
    orientation: Quaternion = parameter(
        IDENTITY, 'quaternion x y z w', low=-1e6, high=1e6, fixed=True
    )

    def check(self) -> None:
        """Normalise the quaternion."""
        unit = unit_vector('sheet.orientation', self.orientation, 'quaternion', IDENTITY)
        object.__setattr__(self, 'orientation', unit)

    @property
    def spacing(self) -> tuple[float, float]:
        """Rest length of the structural springs along x and along y, m."""
        return (
            self.size[0] / max(self.columns - 1, 1),
            self.size[1] / max(self.rows - 1, 1),
        )

    @property
    def diagonal(self) -> float:
        """Length of the diagonal, m; a direction with one particle has no length."""
        return math.hypot(
            self.size[0] * (self.columns > 1),
            self.size[1] * (self.rows > 1),
        )

    @property
    def shortest_spacing(self) -> float:
        """Shortest distance of neighbours in the flat sheet, m; inf for a single particle."""
        return min(
            self.spacing[0] if self.columns > 1 else math.inf,
            self.spacing[1] if self.rows > 1 else math.inf,
        )

    @property
    def cell_mass(self) -> float:
        """Mass of one cell of the grid, and so of a particle inside the sheet, kg."""
        return self.mass / (max(self.rows - 1, 1) * max(self.columns - 1, 1))


@dataclass(frozen=True)
class Springs(ParameterGroup):
    """Stiffness of the three families of Provot (1995), and the dashpots along them."""

    prefix: ClassVar[str] = 'springs.'
    structural: float = parameter(
        500.0, 'stiffness to the 4 neighbours; 0: not modelled', unit='N/m', low=0, high=1e8
    )
    shear: float = parameter(
        250.0,
        'stiffness to the 4 diagonal neighbours; 0: not modelled',
        unit='N/m',
        low=0,
        high=1e8,
    )
    bending: float = parameter(
        50.0, 'stiffness to the 4 second neighbours; 0: not modelled', unit='N/m', low=0, high=1e8
    )
    damping: float = parameter(
        0.0, 'dashpot along each spring; 0: not modelled', unit='N·s/m', low=0, high=1e6
    )


@dataclass(frozen=True)
class Sphere(ParameterGroup):
    """A sphere that moves as commanded, unaffected by the cloth."""

    prefix: ClassVar[str] = 'sphere.'
    radius: float = parameter(0.0, 'radius; 0: no sphere', unit='m', low=0, high=1e3)
    position: Vector = parameter(
        (0.0, 0.0, 0.0), 'centre until a command comes', unit='m', low=-1e6, high=1e6
    )
    friction: float = parameter(0.3, 'coefficient of Coulomb friction', low=0, high=10)

    def check(self) -> None:
        """Refuse spheres that are too small to be resolved."""
        if 0 < self.radius < 1e-4:
            raise invalid_value_error(
                'sphere.radius', self.radius, '0 or at least 0.0001 m', 'write 0.0001'
            )


@dataclass(frozen=True)
class Solver(ParameterGroup):
    """Solver: integrator, substeps, precision, threads and overload."""

    prefix: ClassVar[str] = 'solver.'
    method: str = parameter('auto', 'integration method', choices=('auto', *INTEGRATOR_NAMES))
    substeps: int = parameter(
        0,
        'substeps per tick; 0: chosen from the stability limit and the tolerance',
        low=0,
        high=1_000_000,
    )
    tolerance: float = parameter(
        0.001, 'position error that auto aims for', unit='m', low=1e-6, high=1.0
    )
    precision: str = parameter(
        'single',
        'floating point numbers; auto: double for tolerances below 1 mm',
        choices=('single', 'double', 'auto'),
    )
    threads: int = parameter(1, 'threads that sheets from 64 × 64 on share', low=1, high=64)
    max_tick: float = parameter(
        0.1,
        'longest wall-clock time made up in one tick, but no less than 1.5 ticks',
        unit='s',
        low=1e-3,
        high=10.0,
    )
    overload: str = parameter(
        'slow_motion',
        'what is reduced when the machine cannot keep up: time or accuracy',
        choices=('slow_motion', 'coarsen'),
    )


@dataclass(frozen=True)
class Scene(ParameterGroup):
    """
    A whole scene: the parameters of a cloth, of its air, of colliders and grippers.

    >>> scene = Scene(sheet={'rows': 24, 'columns': 36, 'size': (1.5, 1.0)}, pins=['0,:'])  # m
    >>> scene = scene.with_parameters({'springs.bending': 5.0})  # N/m
    >>> scene.to_yaml('scene.yaml')
    >>> Scene.from_yaml('scene.yaml') == scene
    True

    Groups may be given as mappings or as objects, such as `Sheet`.  Units are SI: m, s, kg, N/m;
    docs/parameters.md lists default, unit and range of each.  A value that is not valid raises a
    ValueError with the value, the allowed range and a remedy.

    """

    frame_id: str = parameter('world', 'frame of all published positions', fixed=True)
    rate: float = parameter(60.0, 'ticks per second', unit='Hz', low=1.0, high=1000.0)
    pins: tuple[str, ...] = parameter(
        ('0,0', '0,-1'), 'pinned particles as "row,column", Python indices and slices'
    )
    drag: float = parameter(0.5, 'decay rate of velocity; 0: none', unit='1/s', low=0, high=1e6)
    gravity: Vector = parameter(
        (0.0, 0.0, -9.81), 'acceleration of gravity', unit='m/s²', low=-1e4, high=1e4
    )
    sheet: Sheet = field(default_factory=Sheet)
    springs: Springs = field(default_factory=Springs)
    wind: Wind = field(default_factory=Wind)
    sphere: Sphere = field(default_factory=Sphere)
    collider: Colliders = field(default_factory=Colliders)
    gripper: Grippers = field(default_factory=Grippers)
    self_contact: SelfContactParameters = field(default_factory=SelfContactParameters)
    solver: Solver = field(default_factory=Solver)
    particles: Particles = field(default_factory=Particles)
    markers: Markers = field(default_factory=Markers)
    clock: SimulationClock = field(default_factory=SimulationClock)
    snapshot: SavedState = field(default_factory=SavedState)

    @classmethod
    def from_yaml(cls, path: str | os.PathLike[str]) -> Scene:
        """
        Read a ROS parameter file.

        Raises
        ------
        ValueError
            The file is not a ROS parameter file, or its scene is not valid.
        OSError
            The file cannot be read.

        """
        try:
            return cls.from_parameters(parameter_file.read(path))
        except ValueError as error:
            raise ValueError(f'{parameter_file.format_path(path)}: {error}') from None

    def to_yaml(self, path: str | os.PathLike[str]) -> None:
        """
        Write the scene to a ROS parameter file, from which `from_yaml` returns an equal one.

        The file has the parameters that differ from the defaults, and `rate`.  One that exists
        is replaced.

        Raises
        ------
        ValueError
            The path is none, or the scene has more pins than a file may.
        OSError
            The file cannot be written.

        """
        parameter_file.save(path, {'rate': self.rate, **self.changed()})

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> Scene:
        """Build a scene from parameters, nested or by dotted names; raises ValueError."""
        scene = cls.from_mapping(parameters)
        assert isinstance(scene, Scene)
        return scene

    def with_parameters(self, changes: Mapping[str, Any]) -> Scene:
        """
        Return this scene with the parameters of these dotted names changed, and checked.

        A change of ``collider.names`` removes the parameters of all colliders that it does not
        name, except those given in the same change; ``gripper.names`` those of grippers.

        Raises
        ------
        ValueError
            The parameters do not exist or are not valid.

        """
        if not isinstance(changes, Mapping):
            raise invalid_value_error(
                'the change', changes, 'a mapping of names to values', "write {'rate': 60.0}"
            )
        whole = [
            name
            for name, value in changes.items()
            if isinstance(name, str) and isinstance(value, ParameterGroup)
        ]
        kept: dict[str, Any] = {}
        for name, value in self.children().items():
            if isinstance(value, NamedGroup):  # as it is: there may be many, checked already
                kept[name] = value.without(whole)
            else:
                kept.update(value.flat() if isinstance(value, ParameterGroup) else {name: value})
        groups = tuple(f'{name}.' for name in whole)
        kept = {
            name: value
            for name, value in kept.items()
            if name not in whole and not name.startswith(groups)
        }
        scene = self.from_parameters({**kept, **changes})
        given = parameter_file.flat(changes)
        kept = {
            group.prefix[:-1]: group.without_unnamed(given)
            for group in scene.named_groups
            if f'{group.prefix}names' in given
        }
        return replace(scene, **kept) if kept else scene

    def check(self) -> None:
        """Refuse names used twice, and pins that there are not; leave out empty pins."""
        check_distinct(self.collider, self.gripper)
        object.__setattr__(self, 'pins', tuple(pin for pin in self.pins if pin.strip()))
        self.pinned()

    @property
    def colliders(self) -> tuple[ColliderParameters, ...]:
        """The colliders of `collider.names`, in that order; the `sphere` is not among them."""
        return self.collider.named

    @property
    def named_groups(self) -> tuple[NamedGroup[Any], ...]:
        """The groups of bodies whose names the user chooses."""
        return (self.collider, self.gripper)

    @property
    def grippers(self) -> tuple[GripperParameters, ...]:
        """The grippers of `gripper.names`, in that order."""
        return self.gripper.named

    def all_colliders(self) -> tuple[ColliderParameters, ...]:
        """Return all colliders of the scene: the sphere, if its radius is not 0, then others."""
        sphere = self.sphere
        if sphere.radius == 0:
            return self.colliders
        first = ColliderParameters(
            name='sphere',
            type='sphere',
            radius=sphere.radius,
            position=sphere.position,
            friction=sphere.friction,
        )
        return (first, *self.colliders)

    @property
    def has_air(self) -> bool:
        """True if there is air that acts on the sheet; a single row has no area to act on."""
        area = self.sheet.rows > 1 and self.sheet.columns > 1
        return area and self.wind.air_density * self.wind.drag_coefficient > 0

    def pinned(self) -> np.ndarray[Any, np.dtype[np.bool_]]:
        """Return which particles are pinned, bool, shape (rows, columns); raises ValueError."""
        return pinned_particles(self.pins, self.sheet.rows, self.sheet.columns)


register(Scene)
