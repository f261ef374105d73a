"""Random scenes, states, inputs and step sequences, drawn by hypothesis: all that is valid."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from hypothesis import assume
from hypothesis import strategies as st

from cloth_ros import Cloth, Scene
from cloth_ros.model.stability import SAFETY

# Substeps and particle steps that one trial may take, before motion divides them.
SUBSTEPS = 1000
PARTICLE_STEPS = 2e5
_MOST_GIVEN = 2000  # substeps that a scene may need at least to be given their number

C = TypeVar('C', bound=Cloth)


@dataclass(frozen=True)
class Input:
    """
    What is done before an advance, and how long that is.

    Attributes
    ----------
    seconds
        To advance; cut where that would be too many substeps.
    wind, sphere
        Commands, m/s and m (from the centre of the sheet, as a multiple of its diagonal);
        None: as before.
    change
        Parameters to change.
    reset
        True to go back to the start.

    """

    seconds: float
    wind: tuple[float, float, float] | None = None
    sphere: tuple[float, float, float] | None = None
    change: tuple[tuple[str, Any], ...] = ()
    reset: bool = False


@dataclass(frozen=True)
class Trial:
    """
    A scene, what state it starts from, and what happens to it.

    Attributes
    ----------
    parameters
        Of the scene, by name.
    start
        `flat`, `crumpled`, `inverted`, `moving` or `coincident`.
    size
        Of the disturbance, as a share of the diagonal, or in diagonals per second.
    seed
        Of the disturbance.
    inputs
        One after the other.

    """

    parameters: tuple[tuple[str, Any], ...]
    start: str = 'flat'
    size: float = 0.1
    seed: int = 0
    inputs: tuple[Input, ...] = ()

    def cloth(self, kind: Callable[[Scene], C] = Cloth) -> C:
        """Return the cloth, of a kind, in its first state."""
        cloth = kind(Scene().with_parameters(dict(self.parameters)))
        generator = np.random.default_rng(self.seed)
        reach = cloth.scene.sheet.diagonal or 1.0
        positions, centre = cloth.positions, np.array(cloth.scene.sheet.position)
        moved = positions.copy()
        if self.start == 'crumpled':
            moved += generator.normal(0, self.size * reach, positions.shape)
        elif self.start == 'inverted':
            moved = centre - self.size * (positions - centre)
        elif self.start == 'coincident':
            moved[:] = centre
        elif self.start == 'moving':
            cloth.velocities = generator.normal(0, self.size * reach, positions.shape)
        pinned = cloth.scene.pinned()
        moved[pinned] = positions[pinned]
        cloth.positions = moved
        return cloth

    def seconds(self, cloth: Cloth, wanted: float) -> float:
        """Return how long to advance, s: `wanted`, or less where that takes too many substeps."""
        particles = cloth.scene.sheet.rows * cloth.scene.sheet.columns
        most = min(SUBSTEPS, PARTICLE_STEPS / particles) / max(len(self.inputs), 1)
        return min(wanted, most * cloth.substep)


def logarithmic(low: float, high: float) -> st.SearchStrategy[float]:
    """Draw numbers of every magnitude."""
    exponents = st.floats(math.log10(low), math.log10(high))
    return exponents.map(lambda exponent: min(max(10.0**exponent, low), high))


def least_substeps(scene: Scene) -> int:
    """Return the least `solver.substeps` that a scene accepts, besides 0."""
    return max(math.ceil(1 / (scene.rate * SAFETY * scene.stability_limit())), 1)


def _or_zero(strategy: st.SearchStrategy[float]) -> st.SearchStrategy[float]:
    return st.one_of(st.just(0.0), strategy)


def _vectors(size: st.SearchStrategy[float]) -> st.SearchStrategy[tuple[float, float, float]]:
    components = st.tuples(*[st.floats(-1, 1)] * 3)
    return st.tuples(components, size).map(
        lambda drawn: tuple(drawn[1] * component for component in drawn[0])  # type: ignore[arg-type, return-value]
    )


_SIDES = st.one_of(st.sampled_from([1, 2, 3]), st.integers(1, 12), st.integers(12, 40))
_PINS = st.one_of(
    st.just(['']),
    st.just([':,:']),
    st.just(['0,0', '0,-1']),
    st.just(['0,:']),
    st.just(['0,0', '-1,-1', '0,-1', '-1,0']),
)


@st.composite
def parameters(draw: st.DrawFn, *, some_springs: bool) -> tuple[tuple[str, Any], ...]:
    """
    Draw the parameters of a valid scene.

    Parameters
    ----------
    draw
        From hypothesis.
    some_springs
        True to leave out some families of springs, which compiles further kernels.

    """
    rows, columns = draw(_SIDES), draw(_SIDES)
    length = draw(logarithmic(1e-3, 1e3))
    aspect = draw(logarithmic(0.1, 10.0))
    stiffest = draw(logarithmic(1e-2, 1e8))
    ratios = [draw(logarithmic(1e-6, 1.0)) for _ in range(2)]
    if some_springs:
        ratios = [draw(_or_zero(st.just(ratio))) for ratio in ratios]
    stiffness = draw(st.permutations([stiffest, *(ratio * stiffest for ratio in ratios)]))
    radius = draw(_or_zero(logarithmic(1e-4, 100.0)))
    away = draw(_vectors(st.sampled_from([0.0, 0.3, 2.0])))
    values: dict[str, Any] = {
        'rate': draw(logarithmic(1.0, 1000.0)),
        'sheet.rows': rows,
        'sheet.columns': columns,
        'sheet.size': [min(max(length * side, 1e-3), 1e3) for side in (1.0, aspect)],
        'sheet.mass': min(draw(logarithmic(1e-9, 1e3)) * rows * columns, 1e9),
        'sheet.position': draw(st.sampled_from([[0.0, 0.0, 1.0], [1e4, -1e4, 100.0]])),
        'pins': draw(_PINS),
        **dict(zip(('structural', 'shear', 'bending'), stiffness, strict=True)),
        'springs.damping': draw(_or_zero(logarithmic(1e-9, 1e6))),
        'drag': draw(st.sampled_from([0.0, 0.0, 0.5, 1e3, 1e6])),
        'gravity': list(draw(_vectors(st.sampled_from([0.0, 9.81, 981.0, 1e4])))),
        'wind.velocity': list(draw(_vectors(st.sampled_from([0.0, 0.0, 10.0, 1e4])))),
        'wind.air_density': draw(st.sampled_from([0.0, 1.2, 1e3])),
        'sphere.radius': radius,
        'sphere.friction': draw(st.sampled_from([0.0, 0.3, 10.0])),
        'solver.precision': draw(st.sampled_from(['single', 'double'])),
    }
    for family in ('structural', 'shear', 'bending'):
        values[f'springs.{family}'] = values.pop(family)
    try:
        least = least_substeps(Scene().with_parameters(values))
    except ValueError:  # more substeps than any machine can take; so it is refused
        assume(condition=False)
    if draw(st.sampled_from([False, False, False, True])) and least <= _MOST_GIVEN:
        values['solver.substeps'] = draw(st.just(least) | st.integers(least, 4 * least))
    centre = np.array(values['sheet.position'])
    reach = length * (1 + aspect) + radius
    values['sphere.position'] = (centre + reach * np.array(away)).tolist()
    return tuple(sorted(values.items()))


@st.composite
def _inputs(draw: st.DrawFn) -> Input:
    change: tuple[tuple[str, Any], ...] = ()
    if draw(st.integers(0, 4)) == 0:
        name, values = draw(
            st.sampled_from(
                [
                    ('springs.structural', logarithmic(1e-2, 1e8)),
                    ('sheet.mass', logarithmic(1e-6, 1e3)),
                    ('sphere.radius', logarithmic(1e-4, 10.0)),
                    ('pins', _PINS),
                    ('gravity', _vectors(st.sampled_from([0.0, 9.81, 1e4])).map(list)),
                ]
            )
        )
        change = ((name, draw(values)),)
    return Input(
        seconds=draw(logarithmic(1e-6, 60.0)),
        wind=draw(st.none() | _vectors(st.sampled_from([5.0, 100.0, 1e4]))),
        sphere=draw(st.none() | _vectors(st.sampled_from([0.0, 0.5, 3.0]))),
        change=change,
        reset=draw(st.integers(0, 9)) == 0,
    )


@st.composite
def trials(draw: st.DrawFn, *, some_springs: bool = False) -> Trial:
    """Draw a trial; see `parameters` for `some_springs`."""
    starts = ('flat', 'crumpled', 'inverted', 'moving', 'coincident')
    return Trial(
        parameters=draw(parameters(some_springs=some_springs)),
        start=draw(st.sampled_from(starts)),
        size=draw(logarithmic(1e-3, 10.0)),
        seed=draw(st.integers(0, 2**31)),
        inputs=tuple(draw(st.lists(_inputs(), min_size=1, max_size=6))),
    )
