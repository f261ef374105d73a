"""Random scenes with an initial state and a sequence of inputs, as hypothesis strategies."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from hypothesis import reject
from hypothesis import strategies as st
from reliability.random_colliders import (
    FAR,
    MOST,
    MOTIONS,
    RADII,
    Motion,
    Vector,
    colliders,
    logarithmic,
    vectors,
)

from cloth_ros import Cloth, Scene
from cloth_ros.model.stability import SAFETY
from cloth_ros.model.time_step import check_time_step, stability_limit

# Substeps and particle steps of one run, before fast motion divides them.
SUBSTEPS, PARTICLE_STEPS = 1000, 2e5
_MOST_FIXED = 2000  # substeps that a scene may need at least where their number is fixed

STARTS = ('flat', 'crumpled', 'inverted', 'moving', 'coincident')


class Step(NamedTuple):
    """Inputs of one advance, and its duration."""

    seconds: float  # less where that takes too many substeps
    wind: Vector | None = None  # m/s
    sphere: Vector | None = None  # from the centre of the sheet, by its diagonal and the radius
    motions: tuple[Motion | None, ...] = ()  # of the other colliders, in their order
    change: dict[str, Any] | None = None  # of parameters, first
    reset: bool = False  # first

    def prepare(self, cloth: Cloth) -> bool:
        """Give the inputs to a cloth; return True if its state or scene was set from outside."""
        scene = cloth.scene
        if self.reset:
            cloth.reset()
        if self.change:
            with suppress(ValueError):  # too many substeps for any machine, or too few
                cloth.configure(scene.with_parameters(self.change))
        if self.wind is not None:
            cloth.wind = self.wind
        if self.sphere is not None and cloth.scene.sphere.radius > 0:
            reach = cloth.scene.sheet.diagonal + cloth.scene.sphere.radius
            with suppress(ValueError):  # too far away
                cloth.move_sphere((scene.sheet.position + reach * np.array(self.sphere)).tolist())
        return self.reset or bool(self.change)

    def move(self, cloth: Cloth, seconds: float) -> None:
        """Command the motions of colliders in an advance of so many s."""
        names = [each.name for each in cloth.scene.colliders if not each.name.startswith(FAR)]
        for name, motion in zip(names, self.motions, strict=False):
            if motion is not None:
                motion.command(cloth, name, seconds)


class Run(NamedTuple):
    """A scene, its initial state, and what happens to it."""

    parameters: dict[str, Any]
    start: str  # one of STARTS
    size: float  # of the disturbance, in diagonals (per second)
    steps: list[Step]
    seed: int = 0  # of the disturbance

    def cloth(self, **options: Any) -> Cloth:
        """Return the cloth in its initial state."""
        cloth = Cloth(Scene().with_parameters(self.parameters), **options)
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


SIDES = st.one_of(st.sampled_from([1, 2, 3]), st.integers(1, 12), st.integers(12, 40))
PINS = st.sampled_from([[''], [':,:'], ['0,0', '0,-1'], ['0,:'], ['0,0', '-1,-1', '0,-1', '-1,0']])


@st.composite
def parameters(draw: st.DrawFn, *, varied: bool) -> dict[str, Any]:
    """
    Draw the parameters of a valid scene.

    Each combination of families of springs (which narrow sheets lack), dashpots and air has
    kernels of its own, which take long to compile: all of them only if `varied`.
    """
    sides = SIDES if varied else st.integers(3, 40)
    rows, columns = draw(sides), draw(sides)
    length, aspect = draw(logarithmic(1e-3, 1e3)), draw(logarithmic(0.1, 10.0))
    least = st.sampled_from([0.0, 1.0]) if varied else st.just(1.0)
    ratios = [draw(logarithmic(1e-6, 1.0)) * draw(least) for _ in range(2)]
    stiffest = draw(logarithmic(1e-2, 1e8))
    structural, shear, bending = draw(st.permutations([stiffest, *(r * stiffest for r in ratios)]))
    damped = draw(st.booleans())
    windy = draw(st.booleans()) if varied else damped
    radius = draw(st.just(0.0) | logarithmic(1e-4, 100.0))
    position = draw(st.sampled_from([(0.0, 0.0, 1.0), (1e4, -1e4, 100.0)]))
    reach, away = length * (1 + aspect) + radius, draw(vectors(0.0, 0.3, 2.0))
    precision = draw(st.sampled_from(['single', 'double']))
    # The kernels with all shapes take the longest to compile.
    shapes = draw(st.booleans()) and (varied or (damped and precision == 'single'))
    size = (length, length * aspect)
    if shapes:
        # Circumradii of few sizes, for which there are distance grids of the meshes.
        spacing = [a / max(n - 1, 1) for a, n in zip(size, (columns, rows), strict=True)]
        scale = draw(st.sampled_from(RADII)) / (0.5 * math.hypot(*spacing))
        size = (scale * size[0], scale * size[1])
    values: dict[str, Any] = {
        'rate': draw(logarithmic(1.0, 1000.0)),
        'sheet.rows': rows,
        'sheet.columns': columns,
        'sheet.size': [min(max(side, 1e-3), 1e3) for side in size],
        'sheet.mass': min(draw(logarithmic(1e-9, 1e3)) * rows * columns, 1e9),
        'sheet.position': list(position),
        'pins': draw(PINS),
        'springs.structural': structural,
        'springs.shear': shear,
        'springs.bending': bending,
        'springs.damping': draw(logarithmic(1e-9, 1e6)) if damped else 0.0,
        'drag': draw(st.sampled_from([0.0, 0.0, 0.5, 1e3, 1e6])),
        'gravity': list(draw(vectors(0.0, 9.81, 981.0, 1e4))),
        'wind.velocity': list(draw(vectors(0.0, 0.0, 10.0, 1e4))),
        'wind.air_density': draw(st.sampled_from([1.2, 1e3])) if windy else 0.0,
        'sphere.radius': radius,
        'sphere.position': [a + reach * b for a, b in zip(position, away, strict=True)],
        'sphere.friction': draw(st.sampled_from([0.0, 0.3, 10.0])),
        'solver.precision': precision,
    }
    if shapes:
        sheet = Scene().with_parameters(values).sheet
        radius = 0.5 * math.hypot(*sheet.spacing)
        lengths = (min(sheet.spacing), sheet.diagonal, 3 * sheet.diagonal)
        values |= draw(colliders(position=position, lengths=lengths, radius=radius or 0.1))
    scene = Scene().with_parameters(values)
    try:
        check_time_step(scene)
    except ValueError:
        reject()  # more substeps than any machine can take
    substeps = least_substeps(scene)
    if draw(st.integers(0, 3)) == 0 and substeps <= _MOST_FIXED:
        values['solver.substeps'] = draw(st.just(substeps) | st.integers(substeps, 4 * substeps))
    return values


CHANGES = {
    'springs.structural': logarithmic(1e-2, 1e8),
    'sheet.mass': logarithmic(1e-6, 1e3),
    'sphere.radius': logarithmic(1e-4, 10.0),
    'pins': PINS,
    'gravity': vectors(0.0, 9.81, 1e4).map(list),
}
STEPS = st.builds(
    Step,
    seconds=logarithmic(1e-6, 60.0),
    wind=st.none() | vectors(5.0, 100.0, 1e4),
    sphere=st.none() | vectors(0.0, 0.5, 3.0),
    motions=st.lists(st.none() | MOTIONS, min_size=MOST, max_size=MOST).map(tuple),
    change=st.integers(0, 4).flatmap(
        lambda n: st.none() if n else st.sampled_from(sorted(CHANGES)).flatmap(
            lambda name: st.fixed_dictionaries({name: CHANGES[name]})
        )
    ),
    reset=st.integers(0, 9).map(lambda n: n == 0),
)  # fmt: skip


def runs(*, varied: bool) -> st.SearchStrategy[Run]:
    """Return a strategy of runs; see `parameters`."""
    return st.builds(
        Run,
        parameters=parameters(varied=varied),
        start=st.sampled_from(STARTS),
        size=logarithmic(1e-3, 10.0),
        steps=st.lists(STEPS, min_size=1, max_size=6),
        seed=st.integers(0, 2**31),
    )
