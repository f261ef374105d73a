"""The point of a triangle that is closest to the origin."""

from __future__ import annotations

from ..kernels.jit import exact_subroutine


@exact_subroutine
def normal_of(points, a, b, c):  # type: ignore[no-untyped-def]
    """Return the normal of a triangle, with the length of twice its area, m²."""
    ux, uy, uz = (
        points[b, 0] - points[a, 0],
        points[b, 1] - points[a, 1],
        points[b, 2] - points[a, 2],
    )
    vx, vy, vz = (
        points[c, 0] - points[a, 0],
        points[c, 1] - points[a, 1],
        points[c, 2] - points[a, 2],
    )
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@exact_subroutine
def _on_segment(ax, ay, az, bx, by, bz):  # type: ignore[no-untyped-def]
    """Return the squared distance of the segment a b from the origin, and the weight of b."""
    ex, ey, ez = bx - ax, by - ay, bz - az
    squared = ex * ex + ey * ey + ez * ez
    t = 0.0
    if squared > 0.0:
        t = min(max(-(ax * ex + ay * ey + az * ez) / squared, 0.0), 1.0)
    x, y, z = ax + t * ex, ay + t * ey, az + t * ez
    return x * x + y * y + z * z, t


@exact_subroutine
def closest_point(points, a, b, c):  # type: ignore[no-untyped-def]
    """
    Find the point of a triangle that is closest to the origin.

    Degenerate triangles are allowed: with b = c it is a segment, with a = b = c a point, and then
    all weight is on the first of equal corners.

    Parameters
    ----------
    points
        m, shape (n, 3), double precision.
    a, b, c
        Which of them are the corners.

    Returns
    -------
    (float, float, float, float)
        Squared distance, m², and the barycentric weights of a, b and c.

    """
    ax, ay, az = points[a, 0], points[a, 1], points[a, 2]
    bx, by, bz = points[b, 0], points[b, 1], points[b, 2]
    cx, cy, cz = points[c, 0], points[c, 1], points[c, 2]
    nx, ny, nz = normal_of(points, a, b, c)
    squared = nx * nx + ny * ny + nz * nz
    if squared > 0.0:
        # Barycentric weights of the origin's projection: areas of b c o, c a o and a b o.
        wa = (
            nx * (by * cz - bz * cy) + ny * (bz * cx - bx * cz) + nz * (bx * cy - by * cx)
        ) / squared
        wb = (
            nx * (cy * az - cz * ay) + ny * (cz * ax - cx * az) + nz * (cx * ay - cy * ax)
        ) / squared
        wc = 1.0 - wa - wb
        if wa >= 0.0 and wb >= 0.0 and wc >= 0.0:
            height = nx * ax + ny * ay + nz * az
            return height * height / squared, wa, wb, wc
    best, t = _on_segment(ax, ay, az, bx, by, bz)
    wa, wb, wc = 1.0 - t, t, 0.0
    if b != c:
        other, t = _on_segment(bx, by, bz, cx, cy, cz)
        if other < best:
            best = other
            wa, wb, wc = 0.0, 1.0 - t, t
        other, t = _on_segment(cx, cy, cz, ax, ay, az)
        if other < best:
            best = other
            wa, wb, wc = t, 0.0, 1.0 - t
    return best, wa, wb, wc
