"""Report of a study in Markdown."""

from __future__ import annotations

from typing import Any

from . import recommendation
from .explanation import recommendation_text
from .formatting import length, percent, table

Result = dict[str, Any]


def _scenario(result: Result) -> str:
    scenario, reference = result['course'], result['reference']
    parts = [f'Simulated time: {scenario["seconds"]:.3g} s']
    if scenario['begins at']:
        parts.append(f'from {scenario["begins at"]:g} s on, just before the first gust')
    if scenario['sphere sent to']:
        x, y, z = scenario['sphere sent to']
        parts.append(f'the sphere moves to ({x:g}, {y:g}, {z:g}) m in {scenario["over"]:g} s')
    if scenario['before the gusts']:
        parts.append('all before the first gust')
    coarse, fine = reference['substeps']
    text = ', '.join(parts) + '. '
    text += (
        f'The reference is {reference["method"]} in double precision with {fine} substeps per '
        'tick; '
    )
    if reference['horizon'] >= scenario['seconds'] * (1 - 1e-9):
        text += (
            f'its difference from the solution with {coarse} is at most '
            f'{length(reference["agreement"])}, and the smallest error below is '
            f'{length(reference["smallest error"])}.'
        )
    elif reference['horizon'] > 0:
        text += (
            f'for {reference["horizon"]:.3g} s its difference from the solution with {coarse} is '
            f'at most {length(reference["agreement"])}, a tenth of the smallest error below or '
            'less. After that the two diverge, and errors are not reported.'
        )
    else:
        text += f'it diverges from the solution with {coarse} at once: no errors can be reported.'
    if reference['apart']:
        times = [
            f'{length(each["distance"])} at {each["time"]:.3g} s' for each in reference['apart']
        ]
        text += f' Their difference first exceeds {", ".join(times)}.'
    return text


def _cost(entry: dict[str, Any]) -> str:
    """Return the median cost of all runs, and their range."""
    wall = entry['wall']
    return f'{wall["median"]:.3g} ({wall["least"]:.3g} to {wall["greatest"]:.3g})'


def _together(entry: dict[str, Any], result: Result) -> str:
    if entry['together'] >= result['course']['seconds'] * (1 - 1e-9):
        return 'the whole run'
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
                f'{found["stretch"]:.2g}',
                percent(found['energy']),
                _together(entry, result),
            ]
        row[0] += ' †' if entry['refused'] else ''
        rows.append(row)
    head = (
        'setting',
        'substeps per tick',
        'cost [s/s]',
        'particle steps per simulated s',
        'largest error',
        'rms error',
        'stretch error',
        'energy error',
        'within 1 % for',
    )
    return table(head, rows)


def _following(result: Result) -> str:
    """Return each setting whose substeps follow the state, beside the same with the bound."""
    rows, saved = [], []
    best = recommendation.frontier(recommendation.candidates(result))
    for entry in result['settings']:
        other = recommendation.without_following(entry, result)
        if other is None or other is entry:
            continue
        cells = [entry['label']]
        for each in (other, entry):
            found = each['error']
            cells += [
                f'{each["substeps per tick"]:.4g}',
                _cost(each),
                length(found['largest']) if found else '',
                'yes' if each in best else '',
            ]
        rows.append(cells)
        saved.append(1 - entry['substeps per tick'] / other['substeps per tick'])
    if not rows:
        return (
            'The same, here: the tolerance, or a resolution that costs next to nothing, asks for '
            'substeps that are shorter than those that are stable in every state.'
        )
    head = ['setting']
    for name in ('bound', 'follow'):
        head += [f'{name}: {each}' for each in ('substeps', 'cost [s/s]', 'error', 'frontier')]
    low, high = percent(min(saved)), percent(max(saved))
    share = low if low == high else f'{low} to {high}'
    return f'{table(head, rows)}\n\nSubsteps that are saved: {share}.'


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
    head = ('rate', 'substeps per tick', 'cost [s/s]', 'largest error', 'rms error')
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
                'finest grid' if last else length(entry['largest']),
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
        'within 1 % for',
    )
    return table(head, rows)


def _stability(result: Result) -> str:
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
        'longest substep used [ms]',
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
    """Return the report of one scene."""
    machine = ', '.join(f'{name} {value}' for name, value in result['machine'].items())
    kind = 'quick' if result['quick'] else 'long'
    return f"""# Speed against accuracy: {result['scene']}

{_scenario(result)}

{recommendation_text(result)}

![work-precision plot](work_precision.png)

## Settings

Bold: on the frontier; no other setting is both cheaper and more accurate. †: the node rejects this
number of substeps, because it is not stable in every state. Cost: wall-clock seconds per simulated
second, median of all runs and range; "particle steps" measure the cost independently of the
machine. Errors are the largest within the time for which they are known. Largest and rms error:
positions, in brackets relative to the sheet's diagonal. Stretch error: of the largest stretch.
Energy error: of the sum of kinetic, elastic and gravitational energy, relative to the largest sum
of the first two. "Within 1 % for": time until the distance from the reference exceeds 1 % of the
diagonal.

{_settings(result)}

## Substeps that follow the state

"Bound": substeps are fixed at the length that is stable in every state of the cloth, and divided
in fast motion only. "Follow", as `auto` chooses them: they are as long as the present state
allows. Substeps are the mean per tick; "frontier": no other setting is both cheaper and more
accurate.

{_following(result)}

## Tick rate

{_rates(result)}

## Grid

The same cloth with fewer or more particles: bending stiffness is scaled with 1/spacing²,
structural and shear stiffness are unchanged. Distance: from the finest grid, at the particles of
the coarser one, within the same time as the errors above. All grids with the scene's tolerance.

{_grids(result)}

## Stability limits

Longest stable substep, predicted from the tangent stiffness of the state and measured by
bisection, and the longest substep that the solver uses in any state. Without dashpots it is the
same for all integrators.

{_stability(result)}

## Energy budget

Work done on the cloth, kinetic and elastic energy gained ("motion"), and the difference, in
brackets relative to the largest work.

{_budget(result)}

## Live error estimate

Error estimate as the node publishes it, and error against a solution with 16 times the substeps.
In each window both start from the state of the cloth.

{_live(result)}

Measured by `cloth_tradeoff`, {kind} form, on: {machine}.
"""
