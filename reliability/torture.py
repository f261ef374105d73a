"""
Random scenes, and whether every promise was kept.

    python -m reliability.torture [--trials 10000] [--seed 0]

Draws scenes, first states, inputs and step sequences (`scenes`), runs each and checks what is
promised for all (`promises`).  The first thousand are given to a plain explicit simulation too.
A trial that breaks a promise is shrunk by hypothesis to the simplest that does, and printed.
Fewer trials than ten thousand are not written to docs/reliability.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings

from .plain import PlainCloth
from .promises import DEPTH, ENERGY, PATIENCE, Outcome, Watch, apply, run
from .record import Row, broken, write
from .scenes import PARTICLE_STEPS, SUBSTEPS, Trial, trials

_TRIALS = 10_000  # of a full run
COMPARED = 1000
STEPS = (1, 10, 100)  # of the plain simulation in a tick
# In one trial, whatever time that is: enough to overflow for all but the slowest explosions.  The
# time of the trial would be a step or two at one a tick, and too many at a hundred.
_PLAIN_STEPS = 400


@dataclass
class Comparison:
    """How many trials a plain simulation ran, and how many of them exploded, by steps a tick."""

    trials: int = 0
    exploded: Counter[int] = field(default_factory=Counter)


def explodes(trial: Trial, steps: int) -> bool:
    """Tell if a plain simulation of a trial, with so many steps a tick, ends not finite."""
    cloth = trial.cloth()
    watch = Watch(cloth, Outcome())
    plain = PlainCloth(cloth, steps)
    for what in trial.inputs:
        apply(trial, cloth, what, watch)
        if what.reset:
            plain = PlainCloth(cloth, steps)
        plain.take(cloth)
        target = cloth.sphere_waypoints[-1] if cloth.sphere_waypoints else cloth.sphere_position
        with np.errstate(all='ignore'):
            plain.advance(_PLAIN_STEPS * plain.step / len(trial.inputs), np.array(target))
        if not plain.finite:
            return True
        cloth.advance(1e-9)  # the sphere arrives
    return False


def torture(
    count: int,
    number: int,
    *,
    some_springs: bool,
    compared: int = 0,
    patience: float = PATIENCE,
) -> tuple[Outcome, Comparison]:
    """
    Run random trials; raise what the first broken promise raises, for the simplest such trial.

    Parameters
    ----------
    count, number
        Of trials, and the seed that they are drawn from.
    some_springs
        True to draw scenes that lack a family of springs as well.
    compared
        How many of them a plain simulation is to run too.
    patience
        Wall-clock time, s, after which a trial is cut.

    """
    outcome, comparison = Outcome(), Comparison()
    start = time.monotonic()

    @seed(number)
    @settings(
        max_examples=count,
        phases=[Phase.generate, Phase.shrink],
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(trials(some_springs=some_springs))
    def try_one(trial: Trial) -> None:
        run(trial, outcome, patience)
        if comparison.trials < compared and trial.inputs:
            comparison.trials += 1
            for steps in STEPS:
                comparison.exploded[steps] += explodes(trial, steps)
        if outcome.trials % 500 == 0:
            print(f'{outcome.trials} trials, {time.monotonic() - start:.0f} s', flush=True)

    try_one()
    return outcome, comparison


def shared(count: int, number: int, compared: int) -> tuple[Outcome, Comparison]:
    """Run random trials on all processors, each from a seed of its own; see `torture`."""
    workers = os.cpu_count() or 1
    outcome, comparison = Outcome(), Comparison()
    with ProcessPoolExecutor(workers, mp_context=get_context('spawn')) as pool:
        shares = [
            pool.submit(
                torture,
                -(-count // workers),
                number + worker,
                some_springs=True,
                compared=-(-compared // workers),
            )
            for worker in range(workers)
        ]
        for share in shares:
            part, compared_part = share.result()
            outcome.add(part)
            comparison.trials += compared_part.trials
            comparison.exploded.update(compared_part.exploded)
    return outcome, comparison


def rows(outcome: Outcome, comparison: Comparison) -> list[Row]:
    """Return what trials came to that have kept every promise; `torture` raises otherwise."""
    started = ', '.join(f'{count} {start}' for start, count in sorted(outcome.starts.items()))
    rollbacks = ', '.join(f'{count} {how}' for how, count in outcome.rollbacks.items())
    total = outcome.trials + outcome.cut
    bounded = outcome.advances - outcome.found - outcome.given
    return [
        Row(
            f'{total} random scenes ({started}), each of at most {SUBSTEPS:,} substeps and '
            f'{PARTICLE_STEPS:,.0f} particle steps before fast motion divides them; '
            f'{outcome.advances} advances',
            'all finite, pins unmoved',
            f'0 not finite, 0 moved; {outcome.cut} cut after {PATIENCE:g} s each, and checked '
            'where they were then',
            kept=True,
        ),
        Row(
            'their energy',
            f'within {100 * ENERGY:g} % of what is turned over of what they had and what was '
            'done to them',
            f'0 outside; in {bounded} advances at most {100 * outcome.energy:.2g} % too much; in '
            f'{outcome.found} others work of the sphere, then or before, is taken as it is found',
            kept=outcome.energy <= ENERGY,
        ),
        Row(
            'the same with a step so long, by solver.substeps, that energy swings by more',
            'no more than that of an oscillator at that step: E / (1 − h² λ/4)',
            f'in {outcome.given} advances 0 outside; at most {100 * outcome.swing:.2g} % of what '
            'that allows',
            kept=outcome.swing <= 1,
        ),
        Row(
            'the springs of sheets without pins, air and sphere',
            'a fall stretches none: no more energy about the centre of mass than there was',
            f'0 of {outcome.free} advances outside',
            kept=True,
        ),
        Row(
            'triangles in the sphere',
            f'none without a pin deeper than {1e3 * DEPTH:g} mm (1 % of a radius below 1 cm) once '
            'it has grown; with a pin as deep as is said',
            f'0 deeper; at most {1e3 * outcome.depth:.2g} mm, rounding of positions included',
            kept=True,
        ),
        Row(
            'the guard',
            'what has too much energy is repeated',
            f'in {outcome.repeated} scenes; of {outcome.stretches:,} stretches: {rollbacks}; '
            f'in {outcome.any_work:,} the work of a sphere that grows or is in the way of pins '
            'could not be bounded',
            kept=True,
        ),
        *(
            Row(
                f'{comparison.trials} of them, plain explicit steps, {steps} a tick; '
                f'{_PLAIN_STEPS} in all, with the inputs evenly among them, whatever time that is',
                '',
                f'{comparison.exploded[steps]} not finite',
                kept=True,
            )
            for steps in STEPS
        ),
    ]


def summary(outcome: Outcome, comparison: Comparison) -> str:
    """Say in a line what trials that have kept every promise came to."""
    exploded = [comparison.exploded[steps] for steps in STEPS]
    return (
        f'{outcome.trials + outcome.cut:,} random scenes with inputs and steps: 0 not finite, '
        f'0 outside their energy; plain explicit steps blow up in {min(exploded)} to '
        f'{max(exploded)} of {comparison.trials:,} of them'
    )


def main() -> int:
    """Run, print and write; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--trials', type=int, default=_TRIALS)
    parser.add_argument('--seed', type=int, default=0)
    arguments = parser.parse_args()
    compared = min(COMPARED, arguments.trials)
    try:
        done = shared(arguments.trials, arguments.seed, compared)
        what, found = summary(*done), rows(*done)
    except Exception as error:  # hypothesis has some of its own, for several broken promises
        what, found = 'random scenes', [broken('random scenes', 'every promise', error)]
    full = arguments.trials >= _TRIALS
    kept = write('torture', 'make torture', 'Random scenes', what, found, full=full)
    return 0 if kept else 1


if __name__ == '__main__':
    sys.exit(main())
