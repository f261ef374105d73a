"""
The error of a running cloth, measured against its own finer solution.

A twin of the cloth starts from the same state at the same time, and is given the same wind and
the same path of the sphere, but takes substeps half as long, in double precision.  It runs in
the time that is left over, as slowly as that takes.  When it has come to the end of a window of
simulated time, its distance from where the cloth then was is what the substep and the precision
of the cloth have added to its error within the window.  For the error of order p that halving
the substep leaves, the distance is multiplied by 2ᵖ/(2ᵖ − 1) (Richardson).

This says nothing of errors that the twin shares: those of the model and of the grid.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..model.cloth import Cloth
from ..model.grid import Array
from ..model.time_step import integrator_for
from ..scene import Scene
from ..scene.parameter import checked_number, one_line
from .kernel_compiler import Background

_FINER = 2
# Longest window, s of simulated time, and the wall-clock time, s, that it may take to sample it.
_WINDOW = 1.0
_PATIENCE = 10.0


@dataclass(frozen=True)
class ErrorEstimate:
    """
    Position error of a cloth that has come up in a window of simulated time.

    Attributes
    ----------
    largest, rms
        Of any particle, and the root of the mean square of all, m.
    seconds
        Length of the window, s.
    time
        Simulated time at its end, s.

    """

    largest: float
    rms: float
    seconds: float
    time: float


def _fine_solution(scene: Scene) -> Cloth:
    twin = Cloth(scene, finer=_FINER)
    twin.compile()
    return twin


class ErrorEstimator:
    """
    Samples the error of a cloth, window after window.

    Parameters
    ----------
    cloth
        What is watched.
    background
        True to make the twin in a thread, as compiling its kernels may take seconds; there is no
        estimate before it is made.

    Attributes
    ----------
    estimate
        Of the last window that is finished; None before the first.

    """

    def __init__(self, cloth: Cloth, *, background: bool = False) -> None:
        self._cloth = cloth
        self._background = background
        self._credit = 0.0
        self._fine_solution: Cloth | None = None
        self._coming: Background[Cloth] | None = None
        self._of: Scene | None = None
        self.restart()
        self._twin_now()  # before the first tick, if that can be

    def restart(self, cloth: Cloth | None = None) -> None:
        """Begin anew, without an estimate, with another cloth or what this one is now."""
        self._cloth = cloth or self._cloth
        self.estimate: ErrorEstimate | None = None
        self._window = 0.0
        self.forget()

    def _twin_now(self) -> Cloth | None:
        """
        Return a twin of the scene that the cloth has now; None while it is made.

        One at most is in the making, however often the scene changes, and none while no one asks.
        """
        scene = self._cloth.scene
        if self._coming is None and self._of is not scene:
            self.forget()
            self._of, self._fine_solution, self._why_none = scene, None, 'not yet sampled'
            double = scene.with_parameters({'solver.precision': 'double'})
            self._coming = Background(lambda: _fine_solution(double))
            if not self._background:
                self._coming.wait()
        if self._coming is not None and self._coming.done:
            self._fine_solution, error, self._coming = self._coming.made, self._coming.error, None
            if error is not None:
                self._why_none = (
                    f'none can be made: {type(error).__name__}, {one_line(str(error))}'
                )
        return self._fine_solution if self._of is scene else None

    def report(self) -> dict[str, object]:
        """Return the estimate by name and unit."""
        if self.estimate is None:
            return {'error estimate [m]': self._why_none}
        return {
            'error estimate [m]': self.estimate.largest,
            'error estimate, root mean square [m]': self.estimate.rms,
            'error estimate, over the last [s]': self.estimate.seconds,
            'error estimate, up to simulated time [s]': self.estimate.time,
        }

    def forget(self) -> None:
        """Give up the present sample: the state of the cloth was changed from outside."""
        self._input_log: list[tuple[float, tuple[float, ...], list[Array]]] = []
        self._recorded = 0.0
        self._recording = False
        self._ahead = self._cloth.time
        self._goal: Array | None = None
        self._march: Iterator[object] = iter(())

    def observe(self, seconds: float) -> None:
        """
        Take note that the cloth is about to advance by `seconds`.

        A window in which an advance went by without that is given up.
        """
        seconds = checked_number('seconds', seconds, 0.0, math.inf, 's')
        cloth, twin = self._cloth, self._twin_now()
        if twin is None:
            return
        if self._recording and cloth.time != self._ahead:
            self.forget()
        if not self._recording and self._goal is None:
            self.forget()  # which ends the march of the twin, before it is set
            twin.adopt(cloth)
            self._recording = True
            self._began = time.perf_counter()
        if self._recording and self._recorded > 0 and self._recorded >= self._window:
            self._goal = cloth.positions
            self._ended = cloth.time
            self._recording = False
        if self._recording:
            self._input_log.append((seconds, cloth.wind, cloth.sphere_waypoints))
            self._recorded += seconds
            self._ahead = cloth.time + seconds

    def work(self, seconds: float) -> None:
        """
        Let the twin run for another `seconds` of wall-clock time, or save them up.

        A substep is never divided: what it takes too long is taken off the next calls.
        """
        if seconds != math.inf:  # which is as long as there is something to do
            seconds = checked_number('seconds', seconds, 0.0, math.inf, 's')
        twin = self._twin_now()
        if twin is None:
            return
        self._credit = min(self._credit + seconds, 20 * seconds)
        start = time.perf_counter()
        while self._credit > time.perf_counter() - start:
            if next(self._march, self) is not self:
                continue
            if self._input_log:
                duration, twin.wind, twin.sphere_waypoints = self._input_log.pop(0)
                self._march = twin.advance_stepwise(duration)
            elif self._goal is not None:
                self._finish(twin, self._goal)
                break
            else:
                break
        self._credit -= time.perf_counter() - start

    def _finish(self, twin: Cloth, goal: Array) -> None:
        distance = np.linalg.norm(twin.positions - goal, axis=-1)
        power = _FINER ** integrator_for(self._cloth.scene).order
        scale = power / (power - 1)
        self.estimate = ErrorEstimate(
            largest=scale * float(distance.max()),
            rms=scale * float(np.sqrt(np.mean(distance**2))),
            seconds=self._recorded,
            time=self._ended,
        )
        # Longer windows as far as they are done in time, shorter ones where they are not.
        if time.perf_counter() - self._began > _PATIENCE:
            self._window = 0.5 * self._recorded
        else:
            self._window = min(2 * self._recorded, _WINDOW)
        self.forget()
