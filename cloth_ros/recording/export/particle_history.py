"""The recorded states of a cloth in the order of their times, and frames of a regular rate."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import islice

import numpy as np

from ..bag import Bag
from ..recorded_cloth import TYPES, Particles, choose_cloth, read_particles
from .mesh_writer import Frame

# States from which the rate is measured.
_MEASURED = 100
# Longest time between two states, s, that is filled with frames: a pause of the cloth, perhaps.
_LONGEST_GAP = 60.0


class ParticleHistory:
    """
    The particles of one cloth of a bag; no other topic is needed.

    Parameters
    ----------
    bag
        The bag.
    node
        Full name of the node, such as `/cloth`; None: the only one that there is.

    Attributes
    ----------
    node
        Full name of the node.
    count
        Number of recorded states; 0 if the bag has no index.
    grid
        Rows and columns of the first state; known when that has been read.
    left_out
        Why states were left out, and how many.

    Raises
    ------
    ValueError
        The bag has no such cloth, several, or no particles of it.

    """

    def __init__(self, bag: Bag, node: str | None = None) -> None:
        self._bag = bag
        self.node = choose_cloth(bag, node)
        self._topic = f'{self.node}/particles'
        if bag.topics.get(self._topic) != TYPES['particles']:
            raise ValueError(
                f'{bag.path} has no {self._topic}, so there is nothing to export; record that '
                'topic as well'
            )
        self.count = bag.count.get(self._topic, 0)
        self.grid = (0, 0)
        self.left_out: dict[str, int] = {}

    def states(
        self, progress: Callable[[int, int], None] = lambda *_: None
    ) -> Iterator[Particles]:
        """
        Yield the states whose time is after that of all before, and whose grid is the first one's.

        Parameters
        ----------
        progress
            Called with the number of states that were read, and of how many; 0: unknown.

        """
        self.left_out.clear()
        last: Particles | None = None
        read = 0
        for message in self._bag.messages():
            if message.topic != self._topic:
                continue
            read += 1
            progress(read, self.count)
            try:
                state = read_particles(message)
            except ValueError as error:
                self._leave_out(str(error))
                continue
            if last is not None and state.values.shape[:2] != self.grid:
                self._leave_out('their grid is another than that of the first one')
            elif last is not None and state.stamp < last.stamp:
                self._leave_out('their time is before that of an earlier one')
            elif last is None or state.stamp > last.stamp:  # a paused cloth publishes states again
                self.grid = state.values.shape[:2]
                last = state
                yield state

    def _leave_out(self, reason: str) -> None:
        self.left_out[reason] = self.left_out.get(reason, 0) + 1

    def rate(self) -> float:
        """Return the rate of the first states, Hz: a whole number from 1 Hz on."""
        stamps = [state.stamp for state in islice(self.states(), _MEASURED)]
        if len(stamps) < 2:
            return 1.0
        rate = 1e9 / float(np.median(np.diff(stamps)))
        return float(round(rate)) if rate >= 1.0 else rate


class Frames:
    """
    Frames of some states.

    Parameters
    ----------
    states
        In the order of their times.
    start, end
        First and last time, s after the first state.
    fps
        Rate of the frames, Hz, each of which is the nearest state; 0: each state is a frame.

    Attributes
    ----------
    jumps
        Where there is no state for so long that there are no frames either, as where the clock has
        jumped: s after the first frame, and how long, s; known when the frames have been taken.

    """

    def __init__(self, states: Iterator[Particles], start: float, end: float, fps: float) -> None:
        self._states, self._fps = _between(states, start, end), fps
        self.jumps: list[tuple[float, float]] = []

    def __iter__(self) -> Iterator[Frame]:
        """Yield the frames, once."""
        return self._every_state() if self._fps == 0.0 else self._nearest_states()

    def _every_state(self) -> Iterator[Frame]:
        first = None
        for state in self._states:
            first = state.stamp if first is None else first
            yield _frame(1e-9 * (state.stamp - first), state)

    def _nearest_states(self) -> Iterator[Frame]:
        fps, number, before, first = self._fps, 0, None, 0
        for state in self._states:
            if before is None:
                first = state.stamp
            else:
                gap = 1e-9 * (state.stamp - before.stamp)
                if gap > _LONGEST_GAP:
                    self.jumps.append((1e-9 * (before.stamp - first), gap))
                    number = max(math.ceil(fps * 1e-9 * (state.stamp - first)), number)
                # Frames up to this state: those before the middle belong to the state before.
                while (time := number * 1e9 / fps) <= state.stamp - first:
                    near = before if 2 * time <= before.stamp + state.stamp - 2 * first else state
                    yield _frame(number / fps, near)
                    number += 1
            before = state
        if before is not None and number == 0:
            yield _frame(0.0, before)


def _between(states: Iterator[Particles], start: float, end: float) -> Iterator[Particles]:
    first = None
    for state in states:
        first = state.stamp if first is None else first
        time = 1e-9 * (state.stamp - first)
        if time > end:
            return
        if time >= start:
            yield state


def _frame(time: float, state: Particles) -> Frame:
    values = state.values.reshape(-1, state.values.shape[-1])
    positions = np.ascontiguousarray(values[:, :3])
    velocities = np.ascontiguousarray(values[:, 3:]) if values.shape[1] > 3 else None
    return Frame(time, positions, velocities)
