"""
Aerodynamic forces on the triangles of a sheet.

The force on a triangle of area A and unit normal n, in air of density ρ that moves relative to it
at u, is

    F = ½ ρ C A |u| (u · n) n,

the normal force of a flat plate, proportional to the sine of its incidence (S. F. Hoerner,
"Fluid-Dynamic Drag", 1965, chapter 3) and is the usual drag where the triangle faces the wind.
Each corner takes a third, with u at its own velocity.  The air so acts on one particle at a time:

    m dv/dt = ½ ρ C |u| M u,   u = wind − v,   M = Σ (A/3) n nᵀ over its triangles,

which a step of length g takes to second order as

    (I + θ G M) u₁ = r − (1 − θ) G M u₀,   G = g ½ ρ C s / m,   θ = (3 + z)/(6 + z),   z = G tr M,

with r what u would be without air and s a prediction of |u| in the middle of the step: a
symmetric positive 3 × 3 system for each particle.  For one triangle, u₁/u₀ is the Padé
approximant (6 − 2z)/(6 + 4z + z²) of e⁻ᶻ, which tends to zero for large z (E. Hairer, G. Wanner,
"Solving Ordinary Differential Equations II", 1996, section IV.3): stable in any wind with any
step.  The terminal velocity, where air, gravity, springs and drag balance, is exact.

Each quad of the grid is two triangles, split by the diagonal from (row, column + 1) to
(row + 1, column).
"""

from __future__ import annotations

import numpy as np

from ...scene import Scene
from ..grid import GHOST_DISTANCE_SQUARED
from ..kernels.jit import inlined

_DEGENERATE = 1e-30  # m⁴, squared area below which a triangle has no normal
# z up to which the step is exact; single precision then keeps I to 0.1 %.
_CAP = 1e4


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
def _scaled_normal(ax, ay, az, bx, by, bz, half, degenerate):  # type: ignore[no-untyped-def]
    """Return s with s sᵀ = A n nᵀ for the triangle between the edges a and b."""
    nx = half * (ay * bz - az * by)
    ny = half * (az * bx - ax * bz)
    nz = half * (ax * by - ay * bx)
    root = np.sqrt(np.sqrt(max(nx * nx + ny * ny + nz * nz, degenerate)))
    return nx / root, ny / root, nz / root


@inlined
def _add_outer(xx, xy, xz, yy, yz, zz, normals, first, i):  # type: ignore[no-untyped-def]
    x, y, z = normals[first, i], normals[first + 1, i], normals[first + 2, i]
    return xx + x * x, xy + x * y, xz + x * z, yy + y * y, yz + y * z, zz + z * z


@inlined
def normals_of_quad(position, out, i, row, half, ghost, degenerate):  # type: ignore[no-untyped-def]
    """Write the s of both triangles of the quad that begins at particle i."""
    one = np.uint64(1)
    ax, ay, az = _edge(position, i, i + one, ghost)
    bx, by, bz = _edge(position, i, i + row, ghost)
    cx, cy, cz = _edge(position, i + row + one, i + row, ghost)
    dx, dy, dz = _edge(position, i + row + one, i + one, ghost)
    out[0, i], out[1, i], out[2, i] = _scaled_normal(ax, ay, az, bx, by, bz, half, degenerate)
    out[3, i], out[4, i], out[5, i] = _scaled_normal(cx, cy, cz, dx, dy, dz, half, degenerate)


@inlined
def matrix(normals, i, row, zero):  # type: ignore[no-untyped-def]
    """Return M of particle i, from the six triangles around it."""
    one = np.uint64(1)
    xx, xy, xz, yy, yz, zz = zero, zero, zero, zero, zero, zero
    xx, xy, xz, yy, yz, zz = _add_outer(xx, xy, xz, yy, yz, zz, normals, 0, i)
    xx, xy, xz, yy, yz, zz = _add_outer(xx, xy, xz, yy, yz, zz, normals, 0, i - one)
    xx, xy, xz, yy, yz, zz = _add_outer(xx, xy, xz, yy, yz, zz, normals, 3, i - one)
    xx, xy, xz, yy, yz, zz = _add_outer(xx, xy, xz, yy, yz, zz, normals, 0, i - row)
    xx, xy, xz, yy, yz, zz = _add_outer(xx, xy, xz, yy, yz, zz, normals, 3, i - row)
    xx, xy, xz, yy, yz, zz = _add_outer(xx, xy, xz, yy, yz, zz, normals, 3, i - row - one)
    return xx, xy, xz, yy, yz, zz


@inlined
def apply_air_drag(matrix, ux, uy, uz, rx, ry, rz, strength, cap, degenerate, unit):  # type: ignore[no-untyped-def]
    """
    Return the velocity u₁ after a kick from u₀ = u, with r as above, all relative to the air.

    `strength` is G / s: the share of the relative velocity lost per area and speed.
    """
    xx, xy, xz, yy, yz, zz = matrix
    one_half = unit / (unit + unit)
    six = unit + unit + unit + unit + unit + unit
    length = max(rx * rx + ry * ry + rz * rz, ux * ux + uy * uy + uz * uz)
    mx = xx * ux + xy * uy + xz * uz
    my = xy * ux + yy * uy + yz * uz
    mz = xz * ux + yz * uy + zz * uz
    trace = max(xx + yy + zz, degenerate)
    # The speed in the middle of the step, by half a step with G of its start.
    rate = strength * np.sqrt(ux * ux + uy * uy + uz * uz)
    half = one_half / (unit + one_half * rate * trace)
    sx = ux + half * (rx - ux - rate * mx)
    sy = uy + half * (ry - uy - rate * my)
    sz = uz + half * (rz - uz - rate * mz)
    rate = strength * np.sqrt(sx * sx + sy * sy + sz * sz)
    # Beyond the cap a particle reaches the velocity of the air within a step anyway, and I would
    # be lost in the rounding of the matrix.
    rate = min(rate, cap / trace)
    theta = one_half + one_half * rate * trace / (six + rate * trace)
    explicit = (theta - unit) * rate
    rx, ry, rz = rx + explicit * mx, ry + explicit * my, rz + explicit * mz
    # By L D Lᵀ; the pivots cannot be below 1, whatever the rounding.
    rate = theta * rate
    d1 = unit + rate * xx
    l21 = rate * xy / d1
    l31 = rate * xz / d1
    d2 = max(unit + rate * yy - l21 * rate * xy, unit)
    l32 = (rate * yz - l31 * rate * xy) / d2
    d3 = max(unit + rate * zz - l31 * rate * xz - l32 * l32 * d2, unit)
    ry = ry - l21 * rx
    rz = rz - l31 * rx - l32 * ry
    z = rz / d3
    y = ry / d2 - l32 * z
    x = rx / d1 - l21 * y - l31 * z
    # Air cannot increase the relative velocity.
    shrink = np.sqrt(min(unit, length / max(x * x + y * y + z * z, degenerate)))
    return shrink * x, shrink * y, shrink * z


def coefficient(scene: Scene) -> float:
    """Return ½ ρ C / 3m, 1/m³: half, and a third of each triangle's area for each corner."""
    wind = scene.wind
    return wind.air_density * wind.drag_coefficient / 6 / scene.sheet.particle_mass


# Bounds that the kernels take: squared distance of ghosts, triangles without a normal, z.
BOUNDS = (GHOST_DISTANCE_SQUARED, _DEGENERATE, _CAP)
