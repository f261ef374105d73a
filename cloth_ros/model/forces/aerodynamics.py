"""
Aerodynamic forces on the particles of a sheet.

The force on a piece of cloth of area A and unit normal n, in air of density ρ that moves relative
to it at u, is

    F = ½ ρ C A |u| (u · n) n,

the normal force of a flat plate, proportional to the sine of its incidence (S. F. Hoerner,
"Fluid-Dynamic Drag", 1965, chapter 3) and is the usual drag where the cloth faces the wind.

The piece of a particle has the area vector

    A n = ¼ (x_right − x_left) × (x_below − x_above),

with the particle itself in place of a neighbour that it lacks at an edge: on a flat sheet exactly
the area that also decides its mass, so that even wind accelerates all particles alike.  The
central differences prefer neither diagonal of a cell, and are of second order in the spacing.

The air so changes the velocity of a particle along its normal only.  With w = n · u for air at
rest, and r what w would be after a step of length g without air,

    (1 + θ z) w₁ = r − (1 − θ) z w₀,   θ = (3 + z)/(6 + z),   z = g ½ ρ C A s / m,

where s is a prediction of |u| in the middle of the step.  w₁/w₀ is then the Padé approximant
(6 − 2z)/(6 + 4z + z²) of e⁻ᶻ, of second order, which tends to zero for large z (E. Hairer,
G. Wanner, "Solving Ordinary Differential Equations II", 1996, section IV.3): stable in any wind
with any step.  The terminal velocity, where air, gravity, springs and drag balance, is exact.
"""

from __future__ import annotations

import numpy as np

from ...scene import Scene
from ..grid import GHOST_DISTANCE_SQUARED
from ..kernels.jit import inlined

_DEGENERATE = 1e-30  # m⁴, squared area below which a piece of cloth has no normal
# Largest z; w₁ is then the millionth part of w₀, and z² is far from overflow in single precision.
_MOST = 1e6


@inlined
def _edge(position, p, q, ghost):  # type: ignore[no-untyped-def]
    """Return the edge q − p, or zero if one of both is a ghost."""
    dx = position[0, q] - position[0, p]
    dy = position[1, q] - position[1, p]
    dz = position[2, q] - position[2, p]
    if dx * dx + dy * dy + dz * dz > ghost:
        dx, dy, dz = dx - dx, dy - dy, dz - dz
    return dx, dy, dz


@inlined
def area_vector(position, i, row, quarter, ghost):  # type: ignore[no-untyped-def]
    """Return the area vector of particle i, m²."""
    one = np.uint64(1)
    ax, ay, az = _edge(position, i, i + one, ghost)
    bx, by, bz = _edge(position, i, i - one, ghost)
    cx, cy, cz = _edge(position, i, i + row, ghost)
    dx, dy, dz = _edge(position, i, i - row, ghost)
    ax, ay, az = quarter * (ax - bx), quarter * (ay - by), quarter * (az - bz)
    cx, cy, cz = cx - dx, cy - dy, cz - dz
    return ay * cz - az * cy, az * cx - ax * cz, ax * cy - ay * cx


@inlined
def air_impulse(vector, ux, uy, uz, rx, ry, rz, strength, degenerate, most, unit):  # type: ignore[no-untyped-def]
    """
    Return the change of a velocity by air in a step: its normal, its size, and mean w, m/s.

    Parameters
    ----------
    vector
        Area vector, m².
    ux, uy, uz
        Velocity relative to the air before the step.
    rx, ry, rz
        The same after the step without air.
    strength
        z per area and speed, s/m³.
    degenerate, most, unit
        Bounds as in `BOUNDS`, and 1, in the precision of the state.

    """
    nx, ny, nz = vector
    half = unit / (unit + unit)
    three = unit + unit + unit
    six = three + three
    area = np.sqrt(max(nx * nx + ny * ny + nz * nz, degenerate))
    nx, ny, nz = nx / area, ny / area, nz / area
    before = nx * ux + ny * uy + nz * uz
    without = nx * rx + ny * ry + nz * rz
    # The speed in the middle of the step, by half a step with z of its start.
    z = strength * area * np.sqrt(ux * ux + uy * uy + uz * uz)
    part = half / (unit + half * z)
    lost = part * z * before
    sx = ux + part * (rx - ux) - lost * nx
    sy = uy + part * (ry - uy) - lost * ny
    sz = uz + part * (rz - uz) - lost * nz
    z = min(strength * area * np.sqrt(sx * sx + sy * sy + sz * sz), most)
    share = z / (six + z)
    after = (without - three * share * before) / (unit + share * (three + z))
    # Air cannot increase the relative velocity.
    limit = max(abs(before), abs(without))
    after = min(max(after, -limit), limit)
    return (nx, ny, nz), after - without, half * (after + without)


def coefficient(scene: Scene) -> float:
    """Return ½ ρ C / m, 1/m³, for particles of the mass of a cell."""
    wind = scene.wind
    return 0.5 * wind.air_density * wind.drag_coefficient / scene.sheet.cell_mass


def coefficient_of_flat_sheet(scene: Scene) -> float:
    """Return κ, 1/m: air accelerates a flat sheet that faces it by κ times the speed squared."""
    dx, dy = scene.sheet.spacing
    return coefficient(scene) * dx * dy if scene.has_air else 0.0


# Bounds that the kernels take: squared distance of ghosts, area without a normal, largest z.
BOUNDS = (GHOST_DISTANCE_SQUARED, _DEGENERATE, _MOST)
