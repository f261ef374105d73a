"""
Estimate the error of a running cloth by comparison with a finer solution.

The finer solution is a second cloth.  It starts from a snapshot of the first one and is given the
same inputs, but takes substeps half as long, in double precision.  It runs in the time that is
left over, as slowly as that takes.  At the end of a window of simulated time, the distance between
both is what the substep length and the precision of the cloth have added to its error within the
window.  For an integrator of order p the distance is multiplied by 2ᵖ/(2ᵖ − 1), which accounts
for the error of the finer solution itself (Richardson extrapolation).  Contact is of first order:
there the estimate is up to a third too small.

Where a sheet folds or slides over a collider, two solutions part faster and faster, and their
distance soon says nothing about the error.  A window therefore is as short as it must be for them
to remain close.

Errors that both solutions share are not included: those of the model and of the grid.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..model import Cloth
from ..model.grid import Array
from ..model.inputs import Inputs
from ..model.step_control import AdaptiveStepControl
from ..model.time_step import integrator_for
from ..scene import Scene
from ..scene.parameter import checked_number, one_line
from .compile_kernels import kinds_of
from .kernel_compiler import NICEST, KernelCompiler

_DIVISION = 2
# Longest window, s of simulated time, and the wall-clock time, s, that it may take to evaluate.
_LONGEST_WINDOW = 1.0
_LONGEST_EVALUATION = 10.0
# Distance of two solutions that are close, as a share of the shortest spacing.
_CLOSE = 0.05
# Calls of `work` whose unused time may be saved.
_SAVED_CALLS = 20


@dataclass(frozen=True)
class ErrorEstimate:
    """
    Position error of a cloth that was added in a window of simulated time.

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


def double_precision(scene: Scene) -> Scene:
    """Return a scene as its finer solution is simulated."""
    return scene.with_parameters({'solver.precision': 'double'})


def fine_solution(scene: Scene) -> Cloth:
    """Return a cloth with substeps half as long, in double precision, its kernels compiled."""
    control = partial(AdaptiveStepControl, division=_DIVISION)
    cloth = Cloth(double_precision(scene), step_control=control)
    for _ in cloth.warm_up():
        pass
    return cloth


def fine_in_background(
    compiler: KernelCompiler, label: Callable[[str], str], scene: Scene
) -> Future[Cloth]:
    """Make `fine_solution` in the background; `label` names its kernels in log messages."""
    double, name = double_precision(scene), label('the error estimate')

    def make() -> Cloth:
        compiler.ensure(double, kinds_of(double), name, NICEST)
        return fine_solution(scene)

    return compiler.submit(make)


def _now(scene: Scene) -> Future[Cloth]:
    future: Future[Cloth] = Future()
    try:
        future.set_result(fine_solution(scene))
    except Exception as error:
        future.set_exception(error)
    return future


class ErrorEstimator:
    """
    Estimate the error of a cloth, window after window.

    Call `observe` before each advance of the cloth and `work` when there is time.

    Parameters
    ----------
    cloth
        The running cloth, which is only read.
    make_fine
        Makes the finer solution of a scene, in the background if that may take long; there is no
        estimate until it is made.  By default it is made at once.

    Attributes
    ----------
    estimate
        Of the last complete window; None before the first.

    """

    def __init__(
        self, cloth: Cloth, *, make_fine: Callable[[Scene], Future[Cloth]] = _now
    ) -> None:
        self._cloth = cloth
        self._make_fine = make_fine
        self._saved = 0.0
        self._fine: Cloth | None = None
        self._fine_scene: Scene | None = None
        self._future: Future[Cloth] | None = None
        self._why_none = 'not yet sampled'
        self.restart()

    def restart(self, cloth: Cloth | None = None) -> None:
        """Restart without an estimate, with another cloth or the present state of this one."""
        self._cloth = cloth or self._cloth
        self.estimate: ErrorEstimate | None = None
        self._window = 0.0
        self.discard()

    def _current_fine(self) -> Cloth | None:
        """
        Return the finer solution for the present scene of the cloth; None while it is made.

        At most one is made at a time, however often the scene changes, and none unless `observe`
        or `work` is called.
        """
        scene = self._cloth.scene
        if self._future is None and self._fine_scene is not scene:
            self.discard()
            self._fine_scene, self._fine, self._why_none = scene, None, 'not yet sampled'
            self._future = self._make_fine(scene)
        if self._future is not None and self._future.done():
            future, self._future = self._future, None
            error = future.exception()
            if error is None:
                self._fine = future.result()
            else:
                text = one_line(str(error))
                self._why_none = f'no finer solution: {type(error).__name__}, {text}'
        return self._fine if self._fine_scene is scene else None

    def report(self) -> dict[str, object]:
        """Return the estimate by name and unit."""
        if self.estimate is None:
            return {'error estimate [m]': self._why_none}
        return {
            'error estimate [m]': self.estimate.largest,
            'error estimate, root mean square [m]': self.estimate.rms,
            'error estimate, window [s]': self.estimate.seconds,
            'error estimate, age [s]': self._cloth.time - self.estimate.time,
        }

    def discard(self) -> None:
        """Discard the present window: the state of the cloth was changed from outside."""
        self._input_log: deque[tuple[float, Inputs]] = deque()
        self._recorded = 0.0
        self._recording = False
        self._expected_time = self._cloth.time
        self._goal: Array | None = None
        self._substeps: Iterator[None] = iter(())

    def observe(self, seconds: float) -> None:
        """
        Record that the cloth is about to advance by `seconds` with its present inputs.

        A window in which an advance was not observed is discarded.
        """
        seconds = checked_number('seconds', seconds, 0.0, math.inf, 's')
        cloth, fine = self._cloth, self._current_fine()
        if fine is None:
            return
        if self._recording and cloth.time != self._expected_time:
            self.discard()
        if not self._recording and self._goal is None:
            self.discard()  # ends the advance of the finer solution before that is restored
            fine.restore(cloth.snapshot())
            self._recording = True
            self._began = time.perf_counter()
        if self._recording and self._recorded > 0 and self._recorded >= self._window:
            self._goal = cloth.positions
            self._end = cloth.time
            self._recording = False
        if self._recording:
            self._input_log.append((seconds, cloth.inputs))
            self._recorded += seconds
            self._expected_time = cloth.time + seconds

    def work(self, seconds: float) -> None:
        """
        Advance the finer solution for `seconds` of wall-clock time, or save them.

        A substep is never interrupted: the time by which it exceeds `seconds` is subtracted from
        the next calls.  With math.inf, all that is to be done is done.
        """
        if seconds != math.inf:
            seconds = checked_number('seconds', seconds, 0.0, math.inf, 's')
        fine = self._current_fine()
        if fine is None:
            return
        self._saved = min(self._saved + seconds, _SAVED_CALLS * seconds)
        start = time.perf_counter()
        while self._saved > time.perf_counter() - start:
            if next(self._substeps, self) is not self:
                continue
            if self._input_log:
                duration, inputs = self._input_log.popleft()
                self._substeps = fine.advance_stepwise(duration, inputs)
            elif self._goal is not None:
                self._finish(fine, self._goal)
                break
            else:
                break
        # Bounded: a process that was stopped in here continues to estimate soon.
        used = time.perf_counter() - start
        self._saved = max(self._saved - used, -_SAVED_CALLS * seconds)

    def _finish(self, fine: Cloth, goal: Array) -> None:
        distance = np.linalg.norm(fine.positions - goal, axis=-1)
        power = _DIVISION ** integrator_for(self._cloth.scene).order
        scale = power / (power - 1)
        self.estimate = ErrorEstimate(
            largest=scale * float(distance.max()),
            rms=scale * float(np.sqrt(np.mean(distance**2))),
            seconds=self._recorded,
            time=self._end,
        )
        # As long as it can be evaluated in time, and the solutions remain close.
        apart = self.estimate.largest > _CLOSE * self._cloth.scene.sheet.shortest_spacing
        if apart or time.perf_counter() - self._began > _LONGEST_EVALUATION:
            self._window = 0.5 * self._recorded
        else:
            self._window = min(2 * self._recorded, _LONGEST_WINDOW)
        self.discard()
