"""
Values that are allowed and almost certainly an error of the unit or of the place.

Each is reported in words that say what it means in SI units, beside a value to compare it with.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from .collider import SHAPE_PARAMETERS
from .conversion import format_value
from .quaternion import rotated
from .scene import Scene

# Areal densities, kg/m²: beyond coated fabric and rubber sheets, and below the thinnest foil.
_DENSEST, _THINNEST = 10.0, 1e-3
_LONGEST = 50.0  # m, of a sheet or a radius: larger than tents, sails and parachutes
_STRONGEST_GRAVITY = 100.0  # m/s²: four times that of Jupiter
_FASTEST_WIND = 150.0  # m/s: beyond every storm
_TOUCHING = 1e-4  # m; a depth that contact allows, or 1 % of a smaller radius
_COARSEST = 0.2  # tolerance, as a share of the diagonal


def implausible_values(scene: Scene) -> dict[str, str]:
    """Return sentences about values that are almost certainly an error, by parameter."""
    return dict(_implausible(scene))


def _implausible(scene: Scene) -> Iterator[tuple[str, str]]:
    sheet = scene.sheet
    sides = [
        side for side, count in zip(sheet.size, (sheet.columns, sheet.rows), strict=True)
        if count > 1
    ]  # fmt: skip
    if len(sides) == 2:
        density = sheet.mass / (sides[0] * sides[1])
        if not _THINNEST <= density <= _DENSEST:
            yield (
                'sheet.mass',
                f'sheet.mass is {sheet.mass:g} kg on {sides[0]:g} m × {sides[1]:g} m: an areal '
                f'density of {density:.3g} kg/m²; cotton fabric has about 0.15 kg/m², so 0.15 kg '
                'for 1 m × 1 m',
            )
    if sides and max(sides) > _LONGEST:
        yield (
            'sheet.size',
            f'sheet.size is [{sheet.size[0]:g}, {sheet.size[1]:g}]: a sheet of '
            f'{max(sides):g} m; lengths are in metres, so 500 mm are 0.5',
        )
    if scene.sphere.radius > _LONGEST:
        yield (
            'sphere.radius',
            f'sphere.radius is {scene.sphere.radius:g}: a sphere {2 * scene.sphere.radius:g} m '
            'wide; lengths are in metres, so 150 mm are 0.15',
        )
    depth = scene.sphere.radius - _distance(scene)
    if depth > min(_TOUCHING, 0.01 * scene.sphere.radius) > 0:
        x, y, z = scene.sphere.position
        yield (
            'sphere.position',
            f'sphere.position is [{x:g}, {y:g}, {z:g}]: in the initial state the sphere of '
            f'radius {scene.sphere.radius:g} m overlaps the sheet by {depth:.2g} m; it starts as '
            'large as there is room and grows at 0.5 m/s',
        )
    yield from _implausible_colliders(scene)
    gravity = math.hypot(*scene.gravity)
    if gravity > _STRONGEST_GRAVITY:
        yield (
            'gravity',
            f'gravity is {gravity:g} m/s², {gravity / 9.81:.3g} times that of the Earth, '
            '9.81 m/s²',
        )
    gusts = scene.wind.gust
    for name, speed in (
        ('wind.velocity', math.hypot(*scene.wind.velocity)),
        ('wind.gust.speed', gusts.speed[1] if gusts.period > 0 else 0.0),
    ):
        if speed > _FASTEST_WIND:
            yield (
                name,
                f'{name} is {speed:g} m/s, {3.6 * speed:.4g} km/h; a hurricane has about 60 m/s',
            )
    if sides and scene.solver.tolerance > _COARSEST * sheet.diagonal:
        yield (
            'solver.tolerance',
            f'solver.tolerance is {scene.solver.tolerance:g} m, on a sheet whose diagonal is '
            f'{sheet.diagonal:.3g} m; it is a length in metres, so 1 mm is 0.001',
        )


def _implausible_colliders(scene: Scene) -> Iterator[tuple[str, str]]:
    flat = scene.collider.flat()
    for collider in scene.colliders:
        used = SHAPE_PARAMETERS[collider.type]
        for name in collider.unused:
            what = f'which has {" and ".join(used)}' if used else 'which has no size'
            yield (
                name,
                f'{name} is {_numbers(flat[name])}: it has no effect on a {collider.type}, {what}',
            )
        for name in map(collider.full_name, used):
            value = flat[name]
            longest = max(value) if isinstance(value, tuple) else value
            if isinstance(longest, float) and longest > _LONGEST:
                yield (
                    name,
                    f'{name} is {_numbers(value)}: lengths are in metres, so 150 mm are 0.15',
                )


def _numbers(value: object) -> str:
    """Return a number, some numbers, or a text in a short form."""
    if isinstance(value, tuple):
        return f'[{", ".join(f"{each:g}" for each in value)}]'
    return f'{value:g}' if isinstance(value, float) else format_value(value)


def _distance(scene: Scene) -> float:
    """Return the distance of the centre of the sphere from the flat sheet, m."""
    sheet = scene.sheet
    offset = (np.array(scene.sphere.position) - sheet.position).tolist()
    i, j, k, w = sheet.orientation
    x, y, z = rotated((-i, -j, -k, w), offset)
    half_x, half_y = (
        0.5 * size * (count > 1)
        for size, count in zip(sheet.size, (sheet.columns, sheet.rows), strict=True)
    )
    return math.hypot(max(abs(x) - half_x, 0.0), max(abs(y) - half_y, 0.0), z)
