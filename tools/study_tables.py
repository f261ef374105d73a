"""Write the results of `make study` to README and docs: ``python -m tools.study_tables``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from cloth_ros.model.integrators import INTEGRATORS
from cloth_ros.tradeoff import plot, recommendation, report
from cloth_ros.tradeoff.analytic_cases import ANALYTIC_CASES
from cloth_ros.tradeoff.formatting import length, percent, table
from cloth_ros.tradeoff.machine import describe_in_a_line
from cloth_ros.tradeoff.published import FIGURES

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


def _grid_error(found: recommendation.GridError | None) -> str:
    if found is None:
        return 'unknown'
    return ('≥ ' if found.finer else '≈ ') + length(found.distance)


def summary(studies: dict[str, dict[str, Any]]) -> str:
    """Return the table of recommended settings for each scene."""
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
                *_choice(recommendation.choose(result).setting),
                _grid_error(recommendation.grid_error(result)),
                *_choice(recommendation.for_accuracy(result)),
                percent(result['budget']['closure']),
                f'{worst:.1f}',
            )
        )
    head = (
        'scene, grid, time with known errors',
        f'recommended setting within {recommendation.SHARE:g} of real time',
        'error of time step and precision',
        'share of real time',
        'error of the grid',
        'cheapest setting within 0.1 mm on the same grid',
        'error',
        'share of real time',
        'unexplained energy',
        'live estimate / true error, worst',
    )
    machine = next(iter(studies.values()))['machine']
    where = f'{machine["processor"]}, {machine["vector instructions"]}, one core'
    forms = {'quick' if result['quick'] else 'long' for result in studies.values()}
    return (
        f'{table(head, rows)}\n\n'
        'Tolerances are in m. The recommended setting is the cheapest one whose whole error, that '
        'of the grid included, no other one reduces by more than '
        f'{percent(recommendation.WORTH - 1)}. Errors are known for the time in the first column: '
        'with a sphere, until contact. The last column is the largest factor between the two in '
        'any window. '
        f'Measured by `make study`, {" and ".join(sorted(forms))} form, on: {where}.\n'
    )


def validation() -> str:
    """Return the page of systems with closed solutions and of published figures."""
    rows = []
    for system in ANALYTIC_CASES:
        found = [system.measure(method) for method in INTEGRATORS]
        exact = found[0].exact
        answer = f'{exact:.6g} {system.unit}' if isinstance(exact, float) else system.unit
        rows.append((system.name, system.text, answer, *(f'{each.error:.1e}' for each in found)))
    head = ('system', 'closed solution', 'value', *INTEGRATORS)
    machine = describe_in_a_line()
    return f"""# Systems with closed solutions

Largest relative difference between each integrator and the closed solution, in double precision.
`make test` runs the same systems, and checks that a force wrong by 1 % is detected in each. It
also measures the order of every integrator as a slope, and compares small sheets with an
independent solution of the same equations.

{table(head, rows)}

## Published figures

Elastic pendulum: a mass on a spring of 0.1 m after 1000 s, from a course (PHYD57, University of
Toronto Scarborough, 2024,
[results](http://planets.utsc.utoronto.ca/~pawel/PHYD57/fin-prob1-2024.res)). Its leapfrog is
position Verlet from a start that differs by half a step: positions differ by up to 1.5 mm for this
reason, the changes of energy agree. Their absolute values are compared; one is printed with the
other sign.

Folded chain: it hangs from both ends, side by side, and one end is released. By the conservation
of energy it falls in 0.8472 of the time of free fall (Calkin and March, Am. J. Phys. 57, 1989,
154); 85 % is the published figure.

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
    return table(('system', 'quantity', 'published', 'simulated'), rows)


def index(studies: dict[str, dict[str, Any]]) -> str:
    """Return the index page of the reports."""
    text = summary(studies).replace(f'({STUDIES}/', '(')
    return f"""# Speed against accuracy

Cost and error of solver settings for four of the scenes of `config/`. How to read the tables and
plots: [How to choose](../choosing.md). The same for another scene: `cloth_tradeoff SCENE`.

{text}"""


def write_tables(studies: dict[str, dict[str, Any]]) -> None:
    """Write reports, plots, index page and the table of the README from the results."""
    for name, result in studies.items():
        (STUDIES / name / 'report.md').write_text(report.page(result))
        plot.draw(result, STUDIES / name)
    (STUDIES / 'README.md').write_text(index(studies))
    fill(Path('README.md'), 'make study', summary(studies))


if __name__ == '__main__':
    write_tables(results())
    Path('docs/validation.md').write_text(validation())
