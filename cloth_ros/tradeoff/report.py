"""The result of a study as a page that people read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from . import recommendation

Result = dict[str, Any]


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table."""
    lines = ['| ' + ' | '.join(head) + ' |', '|' + ' --- |' * len(head)]
    lines += ['| ' + ' | '.join(str(cell) for cell in row) + ' |' for row in rows]
    return '\n'.join(lines)


def length(metres: float) -> str:
    """Return a length with a unit that suits it."""
    for unit, size, least in (('m', 1.0, 1.0), ('mm', 1e-3, 1e-4), ('µm', 1e-6, 1e-7)):
        if metres >= 0.999 * least:
            return f'{metres / size:.3g} {unit}'
    return f'{metres / 1e-9:.3g} nm'


def percent(share: float) -> str:
    """Return a share in percent."""
    return f'{100 * share:.{3 if share >= 1 else 2}g} %'


def _take(entry: dict[str, Any], within: str) -> str:
    """Return what to write, how wrong it is and what it costs."""
    return (
        f'`{recommendation.parameters(entry)}`, error {length(recommendation.error(entry))} {within}, '
        f'{percent(recommendation.cost(entry))} of real time.'
    )


def recommendation_text(result: Result) -> str:
    """Return what to take, in a few sentences with the parameters to write."""
    horizon, known = result['reference']['horizon'], recommendation.usable(result)
    if not known:
        stable = [entry for entry in result['settings'] if not entry['unstable']]
        cheapest = min(recommendation.cost(entry) for entry in stable)
        return (
            '* No error is known, for the reference does not converge (see above). Stable '
            f'settings take {percent(cheapest)} of real time and more; stay with the defaults.'
        )
    within = f'in the {horizon:.2g} s that errors are known for'
    name = f'{result["parameters"]["rate"]:g} Hz on this machine'
    best, cheap = recommendation.for_real_time(result), recommendation.for_accuracy(result)
    lines = [
        f'* **{name}**: ' + _take(best, within)
        if best
        else f'* **{name}**: no setting takes less than {percent(recommendation.SHARE)} of real time '
        'with this scene. Take a coarser grid (see below), softer springs, or leave '
        '`solver.overload` to slow time down.'
    ]
    wanted = length(recommendation.ACCURACY)
    if cheap:
        lines.append(f'* **{wanted}**: ' + _take(cheap, within))
    else:
        nearest = min(recommendation.error(entry) for entry in known)
        lines.append(
            f'* **{wanted}**: no tolerance that was tried is as accurate; the best is off by '
            f'{length(nearest)}.'
        )
    if horizon < result['course']['seconds'] * (1 - 1e-9):
        together = [entry['together'] for entry in recommendation.candidates(result)]
        lines.append(
            f'* **After {horizon:.2g} s** no accuracy is known, and these lines say nothing: '
            f'settings stay with the reference, to 1 % of the sheet, for {min(together):.2g} to '
            f'{max(together):.2g} of {result["scenario"]["seconds"]:.2g} s. The defaults serve as '
            'well as any.'
        )
    return '\n'.join(lines)


def _scenario(result: Result) -> str:
    scenario, reference = result['course'], result['reference']
    parts = [f'{scenario["seconds"]:.3g} s were simulated']
    if scenario['begins at']:
        parts.append(f'from {scenario["begins at"]:g} s on, just before the first gust')
    if scenario['sphere sent to']:
        x, y, z = scenario['sphere sent to']
        parts.append(f'the sphere being sent to ({x:g}, {y:g}, {z:g}) m in {scenario["over"]:g} s')
    if scenario['before the gusts']:
        parts.append('all of it before the first gust')
    coarse, fine = reference['substeps']
    text = ', '.join(parts) + '. '
    text += (
        f'The reference is {reference["method"]} in double precision with {fine} substeps a tick; '
    )
    if reference['horizon'] >= scenario['seconds'] * (1 - 1e-9):
        text += (
            f'with {coarse} it differs by {length(reference["agreement"])} at most, the smallest '
            f'error below is {length(reference["smallest error"])}.'
        )
    elif reference['horizon'] > 0:
        text += (
            f'with {coarse} it stays together for {reference["horizon"]:.3g} s to within '
            f'{length(reference["agreement"])}, a tenth of the smallest error below or less. '
            'After that the two part faster than errors could be told from it, as they do in an '
            'impact and in chaos, and errors are not reported.'
        )
    else:
        text += f'with {coarse} it differs from the start: no errors can be reported.'
    if reference['apart']:
        times = [
            f'{length(each["distance"])} at {each["time"]:.3g} s' for each in reference['apart']
        ]
        text += f' The two are first apart by {", ".join(times)}.'
    return text


def _cost(entry: dict[str, Any]) -> str:
    """Return the median of the cost of all runs, and their range."""
    wall = entry['wall']
    return f'{wall["median"]:.3g} ({wall["least"]:.3g} to {wall["greatest"]:.3g})'


def _together(entry: dict[str, Any], result: Result) -> str:
    if entry['together'] >= result['course']['seconds'] * (1 - 1e-9):
        return 'all of it'
    return f'{entry["together"]:.3g} s'


def _settings(result: Result) -> str:
    best = recommendation.frontier(recommendation.candidates(result))
    rows = []
    order = sorted(
        result['settings'], key=lambda entry: (entry['unstable'], recommendation.cost(entry))
    )
    for entry in order:
        found = entry['error']
        row = [
            ('**' + entry['label'] + '**') if entry in best else entry['label'],
            f'{entry["substeps per tick"]:.4g}',
            _cost(entry),
            f'{entry["particle steps"]:.3g}',
        ]
        if entry['unstable']:
            row[2:] = ['', '']
            row += ['**blew up**', '', '', '', '']
        elif found is None:
            row += ['', '', '', '', _together(entry, result)]
        else:
            row += [
                f'{length(found["largest"])} ({percent(found["largest of the sheet"])})',
                f'{length(found["rms"])} ({percent(found["rms of the sheet"])})',
                f'{found["strain"]:.2g}',
                percent(found['energy']),
                _together(entry, result),
            ]
        row[0] += ' †' if entry['refused'] else ''
        rows.append(row)
    head = (
        'setting',
        'substeps a tick',
        'cost [s/s]',
        'particle steps per simulated s',
        'largest error',
        'rms error',
        'strain error',
        'energy error',
        'together for',
    )
    return table(head, rows)


def _rates(result: Result) -> str:
    rows = []
    for entry in result['rates']:
        found = entry['error']
        rows.append(
            (
                f'{entry["setting"]["rate"]:g} Hz',
                f'{entry["substeps per tick"]:.4g}',
                _cost(entry),
                length(found['largest']) if found else '',
                length(found['rms']) if found else '',
            )
        )
    head = ('rate', 'substeps a tick', 'cost [s/s]', 'largest error', 'rms error')
    return table(head, rows)


def _grids(result: Result) -> str:
    rows = []
    for number, entry in enumerate(result['grids']):
        last = number == len(result['grids']) - 1
        rows.append(
            (
                f'{entry["rows"]} × {entry["columns"]}',
                f'{entry["bending"]:.4g}',
                _cost(entry),
                f'{entry["particle steps"]:.3g}',
                'the finest' if last else length(entry['largest']),
                '' if last else length(entry['rms']),
                '' if last else _together(entry, result),
            )
        )
    head = (
        'grid',
        'bending [N/m]',
        'cost [s/s]',
        'particle steps per simulated s',
        'largest distance',
        'rms distance',
        'together for',
    )
    return table(head, rows)


def _breaking(result: Result) -> str:
    rows = [
        (
            row['method'],
            row['state'],
            f'{1e3 * row["predicted"]:.4g}',
            f'{1e3 * row["measured"]:.4g}',
            f'{row["predicted"] / row["measured"]:.3f}',
            f'{1e3 * row["taken"]:.4g}',
        )
        for row in result['breaking']
    ]
    head = (
        'method',
        'state',
        'predicted [ms]',
        'measured [ms]',
        'predicted / measured',
        'longest step taken [ms]',
    )
    return table(head, rows)


def _budget(result: Result) -> str:
    budget = result['budget']
    names = ('gravity', 'air', 'drag', 'dashpots', 'contact')
    head = ['', *(f'work of {name}' for name in names), 'motion', 'unexplained']
    row = ['[J]', *(f'{budget[name]:.4g}' for name in names), f'{budget["motion"]:.4g}']
    row.append(f'{budget["unexplained"]:.2g} ({percent(budget["closure"])})')
    return table(head, [row])


def _live(result: Result) -> str:
    rows = [
        (
            f'{each["time"]:.3g}',
            f'{each["seconds"]:.3g}',
            length(each['estimate']),
            length(each['truth']),
            f'{each["estimate"] / each["truth"]:.2f}' if each['truth'] > 0 else '',
        )
        for each in result['live error']
    ]
    return table(('up to [s]', 'over [s]', 'estimate', 'true', 'ratio'), rows)


def page(result: Result) -> str:
    """Return the report of one scene, in Markdown."""
    machine = ', '.join(f'{name} {value}' for name, value in result['machine'].items())
    kind = 'quick' if result['quick'] else 'long'
    return f"""# Speed against accuracy: {result['scene']}

{_scenario(result)}

{recommendation_text(result)}

![work-precision plot](work_precision.png)

## Settings

Bold: on the frontier, nothing is both cheaper and more accurate. †: the node refuses this number
of substeps, for it is not stable in every state. Costs are wall-clock seconds per simulated
second, the median of all runs and their range; "particle steps" are the same without the noise of
a machine. Errors are the greatest within the time that they are known for: those of positions, in
brackets relative to the sheet's diagonal; the strain error is that of the largest strain; the
energy error is that of kinetic, elastic and gravitational energy together, relative to the
greatest that the first two have been. "Together": until the distance from the reference reaches
1 % of the diagonal.

{_settings(result)}

## Rate of the ticks

{_rates(result)}

## Grid

The same cloth with fewer or more particles: the stiffness of the bending springs is scaled with
one over the spacing squared, structural and shear stiffness stay. The distance is that from the
finest grid that was tried, at the particles of the coarser one, within the same time as errors
above. All at the scene's own tolerance.

{_grids(result)}

## Where the methods break

Longest stable step, predicted from the stiffness of the state and measured by bisection, and the
longest step that the solver takes in any state. Without dashpots the methods are alike in this.

{_breaking(result)}

## Energy

Work done on the cloth, and the kinetic and elastic energy gained; the
unexplained in brackets relative to the largest of these.

{_budget(result)}

## The live error estimate

What the node publishes as its error beside the error against a solution with 16 times the
substeps. Each window begins anew, without the error that the cloth has by then.

{_live(result)}

Measured by `cloth_tradeoff`, {kind} form, on: {machine}.
"""
