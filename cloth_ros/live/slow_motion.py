"""
Why a running cloth loses time, in words.

Three causes are told apart by what `Pacing` has measured: the simulation itself takes too much
processor time; the process did not get the processor while it simulated; or neither, so that ticks
came late.
"""

from __future__ import annotations

from ..model.time_step import usual_substep
from ..scene import Scene
from .overload import OVERLOADED
from .pacing import PacingReport
from .real_time_advice import advice, remedies

# Share of the wall-clock time without a processor that is worth to be mentioned.
_WAITING = 0.2
# Factors of division and cost of a substep that are not usual.
_DIVIDED, _EXPENSIVE = 1.25, 1.5
# Advice is computed anew if the cost of a substep has changed by this factor: it takes some 0.1 s.
_CHANGED = 1.5


def _particles(scene: Scene) -> int:
    return scene.sheet.rows * scene.sheet.columns


def _unusual(load: float, usual_load: float, division: float) -> str:
    """Return why the load is higher than without contact and fast motion; empty if neither is."""
    reasons = []
    if division > _DIVIDED:
        reasons.append(f'fast motion divides substeps by {division:.2g}')
    cost = load / division / usual_load if usual_load > 0 else 1.0
    if cost > _EXPENSIVE:
        reasons.append(f'contact makes a substep {cost:.2g} times as expensive')
    return ' and '.join(reasons)


class SlowMotion:
    """Explains lost time; the last advice is kept, because it is asked for once a second."""

    def __init__(self) -> None:
        self._key: tuple[Scene, bool] | None = None
        self._cost = 0.0
        self._text = ''

    def advice(self, scene: Scene, cost: float) -> str:
        """Return why a scene is too slow at a cost of a substep, s, and what would help."""
        return self._kept(scene, cost, usual=True)

    def _kept(self, scene: Scene, cost: float, *, usual: bool) -> str:
        if self._key != (scene, usual) or not 1 / _CHANGED < cost / self._cost < _CHANGED:
            self._key, self._cost = (scene, usual), cost
            if usual:
                self._text = advice(scene, cost)
            else:  # not by longer substeps: fast motion would divide them further
                helpful = remedies(scene, cost, coarser_only=True)
                self._text = ' | '.join(remedy.text for remedy in helpful)
        return self._text

    def explain(
        self,
        requested: Scene,
        simulated: Scene,
        usual_cost: float,
        report: PacingReport,
        division: float,
    ) -> str:
        """
        Return why time was lost.

        Parameters
        ----------
        requested, simulated
            The scene that was requested, and what is simulated of it.
        usual_cost
            Cost of a substep without contact, s.
        report
            Measured since the last report.
        division
            By which substeps were divided since then, in fast motion or by the energy monitor.

        """
        substep = usual_substep(simulated)
        load, usual_load = report.cost / substep, usual_cost / substep
        # Advice is for the parameters that the user has set.
        scale = _particles(requested) / _particles(simulated)
        waited = ''
        if (waiting := report.wall - report.cpu) > _WAITING * report.wall:
            waited = (
                f'the process did not get the processor for {waiting:.2g} s of the '
                f'{report.wall:.2g} s that the simulation took: other processes had it'
            )
        if usual_load >= OVERLOADED:
            text = self.advice(requested, scale * usual_cost)
            return f'{waited}; {text}' if waited else text
        unusual = _unusual(load, usual_load, division)
        # Other processes also slow down those that do get a processor.
        if load < OVERLOADED or (waited and not unusual):
            why = waited or 'ticks came late: the process was stopped or was busy otherwise'
            return f'{why}; the simulation itself takes {100 * load:.0f} % of real time'
        text = (
            f'{unusual or "a substep is more expensive than at the start"}: the simulation takes '
            f'{100 * load:.0f} % of real time, instead of {100 * usual_load:.0f} %'
        )
        if helpful := self._kept(requested, scale * report.cost, usual=False):
            text += f'; one of these makes it real time: {helpful}'
        return f'{waited}; {text}' if waited else text
