"""
Tree of bounding boxes, to search triangles or edges.

A complete binary tree over the items in Morton order (G. M. Morton, "A Computer Oriented Geodetic
Data Base", 1966), `LEAF` items in each leaf.  Node 1 is the root, and 2 k and 2 k + 1 are below
node k.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...grid import Array
from ...kernels.jit import exact_subroutine

LEAF = 4
# Nodes that wait while a tree is searched: one for each level.
STACK = 64


class Tree(NamedTuple):
    """
    Tree of bounding boxes.

    Attributes
    ----------
    bounds
        Low x y z, then high x y z, m, shape (2 × leaves, 6).
    items
        The items of the leaves in their order, shape (n,).

    """

    bounds: Array
    items: Array


def _morton(points: Array) -> Array:
    """Return the Morton codes of some points, shape (n, 3)."""
    low = points.min(axis=0)
    extent = max(float((points.max(axis=0) - low).max()), 1e-300)
    cells = ((points - low) * (2**20 / extent)).astype(np.uint64)
    codes = np.zeros(len(points), np.uint64)
    for bit in range(21):
        for axis in range(3):
            codes |= ((cells[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(
                3 * bit + axis
            )
    return codes


def build_tree(corners: Array) -> Tree:
    """
    Return a tree over items.

    Parameters
    ----------
    corners
        Of each item, m, shape (n, k, 3): 3 corners of a triangle, or 2 ends of an edge.

    """
    lower, upper = corners.min(axis=1), corners.max(axis=1)
    items = np.argsort(_morton(corners.mean(axis=1)), kind='stable')
    leaves = 1
    while leaves * LEAF < len(items):
        leaves *= 2
    boxes: Array = np.empty((leaves * LEAF, 6))
    boxes[:, :3], boxes[:, 3:] = np.inf, -np.inf
    boxes[: len(items)] = np.hstack([lower[items], upper[items]])
    bounds = np.empty((2 * leaves, 6))
    boxes = boxes.reshape(leaves, LEAF, 6)
    while True:
        count = len(boxes)
        bounds[count : 2 * count, :3] = boxes[:, :, :3].min(axis=1)
        bounds[count : 2 * count, 3:] = boxes[:, :, 3:].max(axis=1)
        if count == 1:
            return Tree(bounds, items)
        boxes = bounds[count : 2 * count].reshape(count // 2, 2, 6)


@exact_subroutine
def box_distance(bounds, node, x, y, z):  # type: ignore[no-untyped-def]
    """Return the squared distance of a point from a box of the tree, m²."""
    dx = max(bounds[node, 0] - x, x - bounds[node, 3], 0.0)
    dy = max(bounds[node, 1] - y, y - bounds[node, 4], 0.0)
    dz = max(bounds[node, 2] - z, z - bounds[node, 5], 0.0)
    return dx * dx + dy * dy + dz * dz
