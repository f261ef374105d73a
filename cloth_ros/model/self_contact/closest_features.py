"""
Closest points of a vertex and a triangle, and of two edges.

A pair of features is four particles: the vertex and the corners of the triangle, or the ends of
one edge and those of the other.  The vector between the closest points is the sum of their
positions with weights, of which those of the second feature are negative.

The algorithms are those of C. Ericson, "Real-Time Collision Detection", 2005, sections 5.1.5 and
5.1.9.
"""

from __future__ import annotations

import numpy as np

from ..kernels.jit import exact_inlined


@exact_inlined
def _weights_in_triangle(p, q, r, x, i, j, k):  # type: ignore[no-untyped-def]
    """Return the barycentric weights of the point of a triangle that is closest to p q r."""
    ux, uy, uz = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
    vx, vy, vz = x[k, 0] - x[i, 0], x[k, 1] - x[i, 1], x[k, 2] - x[i, 2]
    px, py, pz = p - x[i, 0], q - x[i, 1], r - x[i, 2]
    uu, uv, vv = (
        ux * ux + uy * uy + uz * uz,
        ux * vx + uy * vy + uz * vz,
        vx * vx + vy * vy + vz * vz,
    )
    up, vp = ux * px + uy * py + uz * pz, vx * px + vy * py + vz * pz
    if up <= 0.0 and vp <= 0.0:
        return 1.0, 0.0, 0.0
    up2, vp2 = up - uu, vp - uv
    if up2 >= 0.0 and vp2 <= up2:
        return 0.0, 1.0, 0.0
    wk = up * vp2 - up2 * vp
    if wk <= 0.0 and up >= 0.0 and up2 <= 0.0:
        t = up / (up - up2)
        return 1.0 - t, t, 0.0
    up3, vp3 = up - uv, vp - vv
    if vp3 >= 0.0 and up3 <= vp3:
        return 0.0, 0.0, 1.0
    wj = up3 * vp - up * vp3
    if wj <= 0.0 and vp >= 0.0 and vp3 <= 0.0:
        t = vp / (vp - vp3)
        return 1.0 - t, 0.0, t
    wi = up2 * vp3 - up3 * vp2
    if wi <= 0.0 and vp2 >= up2 and up3 >= vp3:
        t = (vp2 - up2) / ((vp2 - up2) + (up3 - vp3))
        return 0.0, 1.0 - t, t
    total = wi + wj + wk
    return wi / total, wj / total, wk / total


@exact_inlined
def _parameters_on_edges(x, i, j, k, h):  # type: ignore[no-untyped-def]
    """Return where the closest points of two edges are: the weights of j and of h."""
    ux, uy, uz = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1], x[j, 2] - x[i, 2]
    vx, vy, vz = x[h, 0] - x[k, 0], x[h, 1] - x[k, 1], x[h, 2] - x[k, 2]
    rx, ry, rz = x[i, 0] - x[k, 0], x[i, 1] - x[k, 1], x[i, 2] - x[k, 2]
    uu, vv, uv = (
        ux * ux + uy * uy + uz * uz,
        vx * vx + vy * vy + vz * vz,
        ux * vx + uy * vy + uz * vz,
    )
    ur, vr = ux * rx + uy * ry + uz * rz, vx * rx + vy * ry + vz * rz
    if uu <= 0.0:
        return 0.0, min(max(vr / vv, 0.0), 1.0) if vv > 0.0 else 0.0
    if vv <= 0.0:
        return min(max(-ur / uu, 0.0), 1.0), 0.0
    s, area = 0.0, uu * vv - uv * uv
    if area > 1e-12 * uu * vv:  # not parallel
        s = min(max((uv * vr - ur * vv) / area, 0.0), 1.0)
    t = (uv * s + vr) / vv
    if t < 0.0:
        return min(max(-ur / uu, 0.0), 1.0), 0.0
    if t > 1.0:
        return min(max((uv - ur) / uu, 0.0), 1.0), 1.0
    return s, t


@exact_inlined
def closest(x, edges, i, j, k, h):  # type: ignore[no-untyped-def]
    """
    Return the distance of a pair of features, the direction and the weights of its particles.

    Parameters
    ----------
    x
        Positions, m, shape (n, 3), double precision.
    edges
        True for the edges i j and k h, False for the vertex i and the triangle j k h.
    i, j, k, h
        Particles.

    Returns
    -------
    (float, float, float, float, float, float, float, float)
        Distance, m; unit vector from the second feature to the first, 0 if they touch; weights.

    """
    if edges:
        s, t = _parameters_on_edges(x, i, j, k, h)
        wi, wj, wk, wl = 1.0 - s, s, t - 1.0, -t
    else:
        a, b, c = _weights_in_triangle(x[i, 0], x[i, 1], x[i, 2], x, j, k, h)
        wi, wj, wk, wl = 1.0, -a, -b, -c
    # Differences from one particle: those of coordinates far from the origin are more exact.
    nx = wj * (x[j, 0] - x[i, 0]) + wk * (x[k, 0] - x[i, 0]) + wl * (x[h, 0] - x[i, 0])
    ny = wj * (x[j, 1] - x[i, 1]) + wk * (x[k, 1] - x[i, 1]) + wl * (x[h, 1] - x[i, 1])
    nz = wj * (x[j, 2] - x[i, 2]) + wk * (x[k, 2] - x[i, 2]) + wl * (x[h, 2] - x[i, 2])
    d = np.sqrt(nx * nx + ny * ny + nz * nz)
    if d > 0.0:
        nx, ny, nz = nx / d, ny / d, nz / d
    return d, nx, ny, nz, wi, wj, wk, wl


@exact_inlined
def separation(x, edges, i, j, k, h, nx, ny, nz):  # type: ignore[no-untyped-def]
    """
    Return the width, m, of the gap between a pair of features along a unit vector.

    It is at most their distance, and negative if no plane with this normal separates them.
    """
    ei = nx * (x[j, 0] - x[i, 0]) + ny * (x[j, 1] - x[i, 1]) + nz * (x[j, 2] - x[i, 2])
    ek = nx * (x[k, 0] - x[i, 0]) + ny * (x[k, 1] - x[i, 1]) + nz * (x[k, 2] - x[i, 2])
    el = nx * (x[h, 0] - x[i, 0]) + ny * (x[h, 1] - x[i, 1]) + nz * (x[h, 2] - x[i, 2])
    if edges:
        return min(ei, 0.0) - max(ek, el)
    return -max(ei, ek, el)
