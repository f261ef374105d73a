"""Cloths that repeat recorded ticks: with the same steps, or with another scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..live.coarse_cloth import CoarseCloth
from ..live.keyframe import Keyframe, keyframe_of
from ..live.tick_record import CONFIGURED, RESET, Change, TickRecord
from ..model import Cloth
from ..model.inputs import Inputs
from ..model.resample import interpolate
from ..model.snapshot_file import encode
from ..scene import Scene


class RepeatedCloth:
    """
    A cloth that repeats the recorded ticks exactly.

    Every state is that of the recorded cloth, to the bit, by the same version on the same kind of
    processor.
    """

    def __init__(self) -> None:
        self._cloth: CoarseCloth | None = None

    @property
    def cloth(self) -> CoarseCloth:
        """The cloth; there is one from the first keyframe on."""
        assert self._cloth is not None
        return self._cloth

    def start(self, keyframe: Keyframe) -> None:
        """Go on from a keyframe; raises ValueError if that is damaged."""
        former = self._cloth
        if former is None or (former.scene, former.spacing) != (keyframe.scene, keyframe.spacing):
            self._cloth = CoarseCloth(keyframe.scene, keyframe.spacing)
        self.cloth.cloth.restore(keyframe.snapshot)

    def repeat(self, record: TickRecord) -> None:
        """Repeat a tick."""
        for change in record.changes:
            if change.kind == CONFIGURED:
                self._cloth = self.cloth.changed(change.scene, change.spacing)
            elif change.kind == RESET:
                self.cloth.cloth.reset()
        self.cloth.cloth.advance(record.seconds, record.inputs)

    def particles(self) -> NDArray[np.float32]:
        """Return x y z vx vy vz of every particle as they are published, (rows, columns, 6)."""
        sheet = self.cloth.scene.sheet
        out = np.empty((sheet.rows, sheet.columns, 6), np.float32)
        self.cloth.write_particles(out)
        return out

    def agrees(self, keyframe: Keyframe) -> bool:
        """Return whether the state is that of a keyframe, to the bit; raises ValueError."""
        # Commands for the next tick are no part of it: the record of that tick has them.
        ours = replace(self.cloth.cloth.snapshot(), inputs=Inputs())
        return encode(ours) == encode(replace(keyframe.snapshot, inputs=Inputs()))

    def keyframe(self, tick: int, stamp: int) -> Keyframe:
        """Return the keyframe of the present state."""
        cloth = self.cloth
        return keyframe_of(cloth.cloth, cloth.scene, cloth.spacing, tick, stamp)


class OtherCloth:
    """
    A cloth that takes the recorded inputs with a scene of its own.

    Parameters
    ----------
    changed
        Returns the scene to simulate for a recorded one; raises ValueError.

    """

    def __init__(self, changed: Callable[[Scene], Scene]) -> None:
        self._changed = changed
        self._cloth: Cloth | None = None

    @property
    def cloth(self) -> Cloth:
        """The cloth; there is one from the first keyframe on."""
        assert self._cloth is not None
        return self._cloth

    def start(self, keyframe: Keyframe) -> None:
        """Go on from a keyframe, converted to this scene; raises ValueError if it is damaged."""
        scene = self._changed(keyframe.scene)
        if self._cloth is None or self._cloth.scene != scene:
            self._cloth = Cloth(scene)
        self._cloth.restore(keyframe.snapshot)

    def repeat(self, record: TickRecord) -> None:
        """Make the tick with the recorded inputs and duration."""
        for change in record.changes:
            if change.kind == CONFIGURED:
                self.cloth.configure(self._changed(change.scene))
            elif change.kind == RESET:
                self.cloth.reset()
        self.cloth.advance(record.seconds, record.inputs)

    def record(self, recorded: TickRecord) -> TickRecord:
        """Return the record of the tick that this cloth has made."""
        changes = tuple(
            Change(CONFIGURED, self._changed(change.scene).flat())
            if change.kind == CONFIGURED
            else change
            for change in recorded.changes
        )
        return TickRecord(
            recorded.tick,
            recorded.stamp,
            recorded.clock,
            self.cloth.time,
            changes,
            recorded.seconds,
            self.cloth.substep,
            recorded.wind,
            recorded.colliders,
            recorded.grippers,
            recorded.grips,
        )

    def keyframe(self, tick: int, stamp: int) -> Keyframe:
        """Return the keyframe of the present state."""
        return keyframe_of(self.cloth, self.cloth.scene, 1, tick, stamp)

    def positions_on(self, rows: int, columns: int) -> NDArray[np.float64]:
        """Return the positions on a grid, m, shape (rows, columns, 3)."""
        positions = self.cloth.positions
        if positions.shape[:2] == (rows, columns):
            return positions
        other: NDArray[np.float64] = interpolate(positions[None], rows, columns)[0]
        return other
