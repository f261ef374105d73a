"""Write what `make study` has measured: ``python -m tools.study_tables``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.tradeoff import recommendation
from cloth_ros.tradeoff.analytic_cases import ANALYTIC_CASES
from cloth_ros.tradeoff.machine import describe
from cloth_ros.tradeoff.published import FIGURES
from cloth_ros.tradeoff.report import length, percent, table

from .marked_block import fill

STUDIES = Path('docs/tradeoff')
SCENES = ('hanging', 'gust', 'drop_on_sphere', 'small_fast_sphere')


def results() -> dict[str, dict[str, Any]]:
    """Return the results of the studies, by scene."""
    paths = {name: STUDIES / name / 'result.json' for name in SCENES}
    return {name: json.loads(path.read_text()) for name, path in paths.items() if path.exists()}


def _choice(entry: dict[str, Any] | None) -> tuple[str, str, str]:
    if entry is None:
        return ('none', '', '')
    share = percent(recommendation.cost(entry))
    return (f'`{recommendation.parameters(entry)}`', length(recommendation.error(entry)), share)


def summary(studies: dict[str, dict[str, Any]]) -> str:
    """Return the table of what to take for each scene."""
    rows = []
    for name, result in studies.items():
        sheet, reference = result['parameters'], result['reference']
        worst = max(
            max(each['estimate'] / each['truth'], each['truth'] / each['estimate'])
            for each in result['live error']
        )
        rows.append(
            (
                f'[{name}]({STUDIES / name}/report.md), {sheet["sheet.rows"]} × '
                f'{sheet["sheet.columns"]}, {reference["horizon"]:.2g} s',
                *_choice(recommendation.for_real_time(result)),
                *_choice(recommendation.for_accuracy(result)),
                percent(result['budget']['closure']),
                f'{worst:.1f}',
            )
        )
    head = (
        'scene, grid, time that errors are for',
        f'most accurate within {recommendation.SHARE:g} of real time',
        'error',
        'share',
        'cheapest within 0.1 mm',
        'error',
        'share',
        'energy unexplained',
        'live estimate off by a factor of',
    )
    machine = next(iter(studies.values()))['machine']
    where = f'{machine["processor"]}, {machine["vector instructions"]}, one of its cores'
    forms = {'quick' if result['quick'] else 'long' for result in studies.values()}
    return (
        f'{table(head, rows)}\n\n'
        'Tolerances are in m. Errors are known for the time in the first column: with a sphere, '
        'until it touches. The last column is the worst of all windows. '
        f'Measured by `make study`, {" and ".join(sorted(forms))} form, on: {where}.\n'
    )


def validation() -> str:
    """Return the page of the systems with known answers and of published figures."""
    rows = []
    for system in ANALYTIC_CASES:
        found = [system.measure(method) for method in INTEGRATORS]
        exact = found[0].exact
        answer = f'{exact:.6g} {system.unit}' if isinstance(exact, float) else system.unit
        rows.append((system.name, system.text, answer, *(f'{each.error:.1e}' for each in found)))
    head = ('system', 'what is known', 'answer', *INTEGRATORS)
    machine = ', '.join(f'{name} {value}' for name, value in describe().items())
    return f"""# Systems with known answers

Largest relative difference between what a method finds and the answer, in double precision. The
same systems are run by `make test`, which also changes each by a hundredth and sees that this is
caught. Where both methods are off by the same, the step was chosen for a frequency that is right
to 0.1 %, which is the same for both, or the answer does not depend on the step. The order of every
method is measured there as a slope (`test/test_order.py`), and small
sheets are compared with an independent solution of the same equations
(`test/test_independent.py`).

{table(head, rows)}

## Published figures

The elastic pendulum is a mass on a spring, 0.1 m long, after 1000 s; its figures are those of a
course (PHYD57, University of Toronto Scarborough, 2024,
[results](http://planets.utsc.utoronto.ca/~pawel/PHYD57/fin-prob1-2024.res)), whose leapfrog is
position Verlet from a start half a step away: its places are off by up to 1.5 mm for that, and
the changes of energy agree all the same. Of these the size is compared; one is printed with the
other sign.

The folded chain hangs from both ends, side by side, and one end is let go: it falls in 0.8472 of
the time of free fall, by the conservation of energy (Calkin and March, Am. J. Phys. 57, 1989,
154); that it is 85 % is what is quoted.

{_published()}

Measured by `make study` on: {machine}.
"""


def _published() -> str:
    rows = [
        (
            figure.name,
            figure.parameter,
            ', '.join(f'{value:.4g}' for value in figure.values),
            ', '.join(f'{value:.4g}' for value in figure.run()),
        )
        for figure in FIGURES
    ]
    return table(('system', 'quantity', 'published', 'found'), rows)


def index(studies: dict[str, dict[str, Any]]) -> str:
    """Return the page that leads to the reports."""
    text = summary(studies).replace(f'({STUDIES}/', '(')
    return f"""# Speed against accuracy, measured

What each setting of the solver costs, and how wrong it is, for the four ready scenes. How to read
this: [How to choose](../choosing.md). The same for a scene of yours: `cloth_tradeoff SCENE`.

{text}"""


def write_tables(studies: dict[str, dict[str, Any]]) -> None:
    """Write what follows from the studies alone."""
    (STUDIES / 'README.md').write_text(index(studies))
    fill(Path('README.md'), 'make study', summary(studies))


if __name__ == '__main__':
    write_tables(results())
    Path('docs/validation.md').write_text(validation())
