"""Compare a repeated cloth with the recorded states, bit by bit."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..live.tick_record import TickRecord
from .repeated_cloth import RepeatedCloth
from .timeline import Checkpoint, Entry, Gap, Start, Step


@dataclass
class Comparison:
    """
    Repeats recorded ticks and compares the states.

    Attributes
    ----------
    cloth
        The cloth that repeats them.
    ticks
        Number of repeated ticks.
    states, differing
        States that were compared, and those of which a bit differs.
    keyframes, differing_keyframes
        The same of the keyframes, which have the precision of the simulation.
    unrecorded
        Repeated ticks whose state was not recorded.
    largest
        Largest distance of a particle from where it was recorded, m.
    first
        The first difference, in words; empty if there is none.
    gaps
        Ticks that were lost by the recorder, in words.

    """

    cloth: RepeatedCloth = field(default_factory=RepeatedCloth)
    ticks: int = 0
    states: int = 0
    differing: int = 0
    keyframes: int = 0
    differing_keyframes: int = 0
    unrecorded: int = 0
    largest: float = 0.0
    first: str = ''
    gaps: list[str] = field(default_factory=list)

    @property
    def identical(self) -> bool:
        """True if something was compared, and no bit differs."""
        return self.states + self.keyframes > 0 and not self.differing + self.differing_keyframes

    def take(self, entry: Entry) -> None:
        """Repeat an entry of the timeline and compare; raises ValueError for a damaged one."""
        if isinstance(entry, Start):
            self.cloth.start(entry.keyframe)
        elif isinstance(entry, Step):
            self.cloth.repeat(entry.record)
            self.ticks += 1
            if entry.recorded is None:
                self.unrecorded += entry.record.seconds > 0
            else:
                self._compare(entry.record, entry.recorded)
        elif isinstance(entry, Checkpoint):
            agrees = self.cloth.agrees(entry.keyframe)
            self.keyframes += 1
            if not agrees:
                self.differing_keyframes += 1
                self.first = self.first or f'the keyframe of tick {entry.keyframe.tick} differs'
        elif isinstance(entry, Gap):
            self.gaps.append(gap_text(entry))

    def _compare(self, record: TickRecord, recorded: NDArray[np.float32]) -> None:
        self.states += 1
        # Positions alone, if velocities were not published.
        ours = self.cloth.particles()[..., : recorded.shape[-1]]
        if ours.shape == recorded.shape and ours.tobytes() == recorded.tobytes():
            return
        self.differing += 1
        if ours.shape != recorded.shape:
            self.first = self.first or f'tick {record.tick}: the grid has another size'
            return
        moved = ours[..., :3].astype(float) - recorded[..., :3]
        distance = np.linalg.norm(np.nan_to_num(moved, nan=np.inf), axis=-1)
        self.largest = max(self.largest, float(distance.max()))
        if not self.first:
            different = (ours.view(np.uint32) != recorded.view(np.uint32)).any(axis=-1)
            row, column = np.argwhere(different)[0].tolist()
            self.first = (
                f'tick {record.tick}, {1e-9 * record.stamp:.6f} s: {int(different.sum())} of '
                f'{different.size} particles differ, first row {row}, column {column}, by '
                f'{distance[row, column]:.3g} m'
            )

    def lines(self) -> list[str]:
        """Return the result in words."""
        compared = f'{self.states} states and {self.keyframes} keyframes'
        if self.identical:
            lines = [f'{self.ticks} ticks repeated: {compared} are identical to the bit']
        elif self.first:
            lines = [
                f'{self.ticks} ticks repeated: {self.differing} of {self.states} states and '
                f'{self.differing_keyframes} of {self.keyframes} keyframes differ, by up to '
                f'{self.largest:.3g} m',
                f'first difference: {self.first}',
            ]
        else:
            lines = [f'{self.ticks} ticks repeated, but there is no state to compare with']
        if self.unrecorded and self.states:
            why = 'particles.rate, or the recorder lost them'
            lines.append(f'{self.unrecorded} states were not recorded ({why})')
        return lines + self.gaps


def gap_text(gap: Gap) -> str:
    """Return what a gap means, in words."""
    if gap.stamp is None:
        return f'gap: behind tick {gap.after} the bag is not complete, and has no later keyframe'
    after = 'behind' if gap.until > gap.after else 'the node was started again behind'
    return (
        f'gap: {after} tick {gap.after}; repeated again behind tick {gap.until}, '
        f'{1e-9 * gap.stamp:.6f} s'
    )
