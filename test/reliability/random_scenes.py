"""Random scenes with an initial state and a sequence of inputs, as hypothesis strategies."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from hypothesis import reject
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model.stability import SAFETY
from cloth_ros.model.time_step import check_time_step, stability_limit

# Substeps and particle steps of one run, before fast motion divides them.
SUBSTEPS, PARTICLE_STEPS = 1000, 2e5
_MOST_FIXED = 2000  # substeps that a scene may need at least where their number is fixed

STARTS = ('flat', 'crumpled', 'inverted', 'moving', 'coincident')

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Step:
    """
    Inputs of one advance, and its duration.

    Attributes
    ----------
    seconds
        Duration, s; less where that takes too many substeps.
    wind
        Command, m/s; None: as before.
    sphere
        Command, m from the centre of the sheet by its diagonal and the radius; None: as before.
    change
        Parameters to change first.
    reset
        True to reset first.

    """

    seconds: float
    wind: Vector | None = None
    sphere: Vector | None = None
    change: tuple[tuple[str, Any], ...] = ()
    reset: bool = False

    def prepare(self, cloth: Cloth) -> bool:
        """Give the inputs to a cloth; return True if its state or scene was set from outside."""
        scene = cloth.scene
        if self.reset:
            cloth.reset()
        with suppress(ValueError):  # too many substeps for any machine, or fewer than required
            cloth.configure(scene.with_parameters(dict(self.change)))
        if self.wind is not None:
            cloth.wind = self.wind
        if self.sphere is not None and cloth.scene.sphere.radius > 0:
            reach = cloth.scene.sheet.diagonal + cloth.scene.sphere.radius
            with suppress(ValueError):  # too far away
                cloth.move_sphere((scene.sheet.position + reach * np.array(self.sphere)).tolist())
        return self.reset or bool(self.change)


@dataclass(frozen=True)
class Run:
    """
    A scene, its initial state, and what happens to it.

    Attributes
    ----------
    parameters
        Of the scene, by name.
    start
        `flat`, `crumpled`, `inverted`, `moving` or `coincident`.
    size
        Of the disturbance, in diagonals, or in diagonals per second.
    seed
        Of the disturbance.
    steps
        Advances with their inputs.

    """

    parameters: tuple[tuple[str, Any], ...]
    start: str = 'flat'
    size: float = 0.1
    seed: int = 0
    steps: tuple[Step, ...] = ()

    def cloth(self, **options: Any) -> Cloth:
        """Return the cloth in its initial state."""
        cloth = Cloth(Scene().with_parameters(dict(self.parameters)), **options)
        generator, sheet = np.random.default_rng(self.seed), cloth.scene.sheet
        positions, centre = cloth.positions, np.array(sheet.position)
        disturbance = self.size * (sheet.diagonal or 1.0) * generator.normal(size=positions.shape)
        if self.start == 'moving':
            cloth.velocities = disturbance
        moved = {
            'crumpled': positions + disturbance,
            'inverted': centre - self.size * (positions - centre),
            'coincident': np.broadcast_to(centre, positions.shape),
        }.get(self.start, positions)
        cloth.positions = np.where(cloth.scene.pinned()[..., None], positions, moved)
        return cloth

    def seconds(self, cloth: Cloth, wanted: float) -> float:
        """Return `wanted`, s, or less where that takes too many substeps."""
        particles = cloth.scene.sheet.rows * cloth.scene.sheet.columns
        most = min(SUBSTEPS, PARTICLE_STEPS / particles) / max(len(self.steps), 1)
        return min(wanted, most * cloth.substep)


def least_substeps(scene: Scene) -> int:
    """Return the least number of substeps that `solver.substeps` may fix."""
    return max(math.ceil(1 / (scene.rate * SAFETY * stability_limit(scene))), 1)


def logarithmic(low: float, high: float) -> st.SearchStrategy[float]:
    """Return a strategy of numbers of every magnitude in a range."""
    exponents = st.floats(math.log10(low), math.log10(high))
    return exponents.map(lambda exponent: min(max(10.0**exponent, low), high))


def vectors(*lengths: float) -> st.SearchStrategy[Vector]:
    """Return a strategy of vectors of one of these sizes."""
    parts = st.tuples(*[st.floats(-1, 1)] * 3)
    return st.tuples(parts, st.sampled_from(lengths)).map(
        lambda drawn: tuple(drawn[1] * part for part in drawn[0])
    )


SIDES = st.one_of(st.sampled_from([1, 2, 3]), st.integers(1, 12), st.integers(12, 40))
PINS = st.sampled_from([[''], [':,:'], ['0,0', '0,-1'], ['0,:'], ['0,0', '-1,-1', '0,-1', '-1,0']])


@st.composite
def parameters(draw: st.DrawFn, *, some_springs: bool) -> tuple[tuple[str, Any], ...]:
    """Draw the parameters of a valid scene; some families of springs absent if `some_springs`."""
    rows, columns = draw(SIDES), draw(SIDES)
    length, aspect = draw(logarithmic(1e-3, 1e3)), draw(logarithmic(0.1, 10.0))
    stiffest, ratios = draw(logarithmic(1e-2, 1e8)), [draw(logarithmic(1e-6, 1.0)) for _ in '12']
    if some_springs:  # each combination has kernels of its own
        ratios = [draw(st.sampled_from([0.0, ratio])) for ratio in ratios]
    structural, shear, bending = draw(
        st.permutations([stiffest, *(ratio * stiffest for ratio in ratios)])
    )
    radius = draw(st.just(0.0) | logarithmic(1e-4, 100.0))
    position = draw(st.sampled_from([(0.0, 0.0, 1.0), (1e4, -1e4, 100.0)]))
    reach = length * (1 + aspect) + radius
    away = draw(vectors(0.0, 0.3, 2.0))
    values: dict[str, Any] = {
        'rate': draw(logarithmic(1.0, 1000.0)),
        'sheet.rows': rows,
        'sheet.columns': columns,
        'sheet.size': [min(max(length * side, 1e-3), 1e3) for side in (1.0, aspect)],
        'sheet.mass': min(draw(logarithmic(1e-9, 1e3)) * rows * columns, 1e9),
        'sheet.position': list(position),
        'pins': draw(PINS),
        'springs.structural': structural,
        'springs.shear': shear,
        'springs.bending': bending,
        'springs.damping': draw(st.just(0.0) | logarithmic(1e-9, 1e6)),
        'drag': draw(st.sampled_from([0.0, 0.0, 0.5, 1e3, 1e6])),
        'gravity': list(draw(vectors(0.0, 9.81, 981.0, 1e4))),
        'wind.velocity': list(draw(vectors(0.0, 0.0, 10.0, 1e4))),
        'wind.air_density': draw(st.sampled_from([0.0, 1.2, 1e3])),
        'sphere.radius': radius,
        'sphere.position': [a + reach * b for a, b in zip(position, away, strict=True)],
        'sphere.friction': draw(st.sampled_from([0.0, 0.3, 10.0])),
        'solver.precision': draw(st.sampled_from(['single', 'double'])),
    }
    scene = Scene().with_parameters(values)
    with suppress(ValueError):
        check_time_step(scene)
        least = least_substeps(scene)
        if draw(st.integers(0, 3)) == 0 and least <= _MOST_FIXED:
            values['solver.substeps'] = draw(st.just(least) | st.integers(least, 4 * least))
        return tuple(sorted(values.items()))
    return reject()  # more substeps than any machine can take


CHANGES = {
    'springs.structural': logarithmic(1e-2, 1e8),
    'sheet.mass': logarithmic(1e-6, 1e3),
    'sphere.radius': logarithmic(1e-4, 10.0),
    'pins': PINS,
    'gravity': vectors(0.0, 9.81, 1e4).map(list),
}


@st.composite
def steps(draw: st.DrawFn) -> Step:
    """Draw an advance and its inputs."""
    change: tuple[tuple[str, Any], ...] = ()
    if draw(st.integers(0, 4)) == 0:
        name = draw(st.sampled_from(sorted(CHANGES)))
        change = ((name, draw(CHANGES[name])),)
    return Step(
        seconds=draw(logarithmic(1e-6, 60.0)),
        wind=draw(st.none() | vectors(5.0, 100.0, 1e4)),
        sphere=draw(st.none() | vectors(0.0, 0.5, 3.0)),
        change=change,
        reset=draw(st.integers(0, 9)) == 0,
    )


@st.composite
def runs(draw: st.DrawFn, *, some_springs: bool = False) -> Run:
    """Draw a run; see `parameters` for `some_springs`."""
    return Run(
        parameters=draw(parameters(some_springs=some_springs)),
        start=draw(st.sampled_from(STARTS)),
        size=draw(logarithmic(1e-3, 10.0)),
        seed=draw(st.integers(0, 2**31)),
        steps=tuple(draw(st.lists(steps(), min_size=1, max_size=6))),
    )
