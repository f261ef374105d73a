"""Contact of a single substep: of particles, of triangles, and of both with several colliders."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from ..grid import Array
from ..state import State, max_speed
from .interfaces import Kicks
from .particle_batch import LEFT, ParticleBatch
from .rigid_collider import RigidCollider
from .triangle_substep import TriangleSubstep

# Sweeps over the colliders that touch the sheet, or that others have moved it into, in which each
# moves it out again of where another one has moved it.
_SWEEPS = 8
# Ratio of the greatest depths in two sweeps, above which there will be none without depth.
_PROGRESS = 0.7


class SubstepOutcome(NamedTuple):
    """
    What has happened in a substep.

    Attributes
    ----------
    touched
        True if a collider has touched the sheet.
    unknown
        True if the work that it did cannot be said.
    fastest
        Speed of the fastest particle after the drift, m/s.

    """

    touched: bool
    unknown: bool
    fastest: float


class SubstepContact:
    """
    Resolves the contact of single substeps.

    Parameters
    ----------
    particles, triangles
        The two ways of contact.

    """

    def __init__(self, particles: ParticleBatch, triangles: TriangleSubstep) -> None:
        self._particles, self._triangles = particles, triangles

    def resolve(
        self,
        kicks: Kicks,
        state: State,
        near: Sequence[RigidCollider],
        by_triangles: set[str],
        times: Array,
        former: float,
    ) -> SubstepOutcome:
        """
        Resolve the contact of a state that has drifted.

        Parameters
        ----------
        kicks
            Of the scene.
        state
            After the drift; changed.
        near, by_triangles
            Colliders in reach, and the names of those that particles are not enough for.
        times
            Before and after the drift, s, shape (2,).
        former
            Speed of the fastest particle before the drift, m/s.

        """
        h = times[1] - times[0]
        self._triangles.follow(by_triangles)
        triangles = [each for each in near if each.name in by_triangles]
        others = [each for each in near if each.name not in by_triangles]
        touching, cut = self._by_particles(kicks, state, others, times, former)
        unknown, moved = True in [each.grows for each in touching], 0.0
        fastest = max_speed(state)
        for each in [*triangles, *cut]:
            touched, forced, farthest = self._triangles.resolve(
                each, state, times, max(former, fastest)
            )
            unknown = unknown or forced or (touched and each.grows)
            if touched and each not in touching:
                touching.append(each)
            moved = max(moved, farthest)
        if moved > 0.0 and len(near) > len(touching):
            touching += self._reached(state, near, touching, moved)
        if len(touching) > 1:
            unknown = self._sweep(kicks, state, touching, times) or unknown
        for each in near:
            each.move_to(times[1])
            each.grow(h)
        return SubstepOutcome(len(touching) > 0, unknown, fastest)

    def _by_particles(
        self,
        kicks: Kicks,
        state: State,
        near: Sequence[RigidCollider],
        times: Array,
        fastest: float,
    ) -> tuple[list[RigidCollider], list[RigidCollider]]:
        """Return which colliders have touched the sheet, and which still cut triangles."""
        if not near:
            return [], []
        self._particles.measure(state, times[1] - times[0], fastest)
        table = self._particles.table(state, near, times, fastest)
        kicks.resolve_contact(state, times[1] - times[0], table)
        touching = self._particles.take(state, near, table)
        cut = self._particles.cut(state, near, table, times[1])
        return touching, [each for each in cut if math.isfinite(each.shape.inner_radius)]

    def _reached(
        self,
        state: State,
        near: Sequence[RigidCollider],
        touching: Sequence[RigidCollider],
        moved: float,
    ) -> list[RigidCollider]:
        """Return the others that those have moved the sheet into, by at most `moved`, m."""
        reached = []
        for each in near:
            if each in touching:
                continue
            each.clearance -= moved
            if each.clearance > 0:
                continue
            if math.isinf(each.shape.inner_radius):
                inside = self._particles.depth(each, state, offset=False) > LEFT
            else:
                inside = self._triangles.depth(each, state) > 2 * each.tolerance
            if inside:
                reached.append(each)
        return reached

    def _sweep(
        self, kicks: Kicks, state: State, touching: Sequence[RigidCollider], times: Array
    ) -> bool:
        """Move the sheet out of all colliders that touch it; return whether it had to move."""
        planes = [each for each in touching if math.isinf(each.shape.inner_radius)]
        bodies = [each for each in touching if each not in planes]
        former, left = math.inf, {each.name: 0.0 for each in bodies}
        for number in range(_SWEEPS):
            depths = []
            for each in bodies:
                depth, left[each.name] = self._triangles.push_out(each, state, times[1])
                depths.append(depth)
            for each in planes:
                depth = self._particles.depth(each, state, offset=False)
                depths.append(depth if depth > LEFT else 0.0)
            deepest = max(depths)
            if deepest <= 0:
                return number > 0
            if planes:
                self._by_particles(kicks, state, planes, times, max_speed(state))
            if deepest > _PROGRESS * former:  # they press the sheet from different sides
                break
            former = deepest
        for each in bodies:
            # The sheet could not be moved out of it, even by it alone: there is no room.
            self._triangles.shrink(each, left[each.name])
        return True
