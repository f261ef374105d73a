"""The recommendation of a study in words, with its reasons and the time that it holds for."""

from __future__ import annotations

import json
import math
from typing import Any

from . import recommendation
from .formatting import length, percent
from .recommendation import ACCURACY, SHARE, Choice, GridError, cost, error, parameters

Result = dict[str, Any]

# Time after the end of the known errors, in samples, in which a contact counts as its cause: the
# reference is compared, and contact is looked for, once a sample.
_SAMPLES = 2


def recommendation_text(result: Result) -> str:
    """Return the recommended settings as a list, with the parameters of a scene file."""
    if recommendation.usable(result):
        lines = [_for_real_time(result), _for_accuracy(result), *_duration(result)]
    else:
        lines = [_without_errors(result), *_duration(result)]
    return '\n'.join(f'* {line}' for line in lines)


def share_of_real_time(seconds: float) -> str:
    """Describe a cost, wall-clock seconds per simulated second."""
    if seconds > 1:
        return f'slower than real time (a simulated second takes {seconds:.3g} s)'
    if seconds > SHARE:
        return f'{percent(seconds)} of real time (which leaves too little for messages)'
    return f'{percent(seconds)} of real time'


def grid_parameters(grid: dict[str, Any]) -> str:
    """Return the parameters of a grid of a study as YAML for a scene file."""
    bending = f'{grid["bending"]:.6f}'.rstrip('0')
    changes = {
        'sheet.rows': str(grid['rows']),
        'sheet.columns': str(grid['columns']),
        # A dot and a digit behind it: ROS takes no integer.
        'springs.bending': f'{bending}0' if bending.endswith('.') else bending,
    }
    if grid['pins']:
        changes['pins'] = json.dumps(grid['pins'])
    return '{' + ', '.join(f'{name}: {value}' for name, value in changes.items()) + '}'


def _size(grid: dict[str, Any]) -> str:
    return f'{grid["rows"]} × {grid["columns"]}'


def _other_grid(grid: dict[str, Any]) -> str:
    """Describe the parameters, the cost and the accuracy of another grid."""
    text = f'`{grid_parameters(grid)}`, {share_of_real_time(cost(grid))}'
    if grid['largest'] > 0:
        return f'{text}, {length(grid["largest"])} from the finest grid'
    return f'{text}, the finest grid that was measured'


def _grid_error(grid: GridError | None) -> str:
    if grid is None:
        return 'an unknown one from the grid, because no other grid was measured'
    if grid.finer:
        return f'{length(grid.distance)} or more from the grid, compared with {_size(grid.other)}'
    return (
        f'about {length(grid.distance)} from the grid, compared with {_size(grid.other)}, because '
        'no finer one was measured'
    )


def _for_real_time(result: Result) -> str:
    """Return the recommendation for real time and its reasons, or why there is none."""
    choice = recommendation.choose(result)
    name = f'**{result["parameters"]["rate"]:g} Hz on this machine**:'
    entry = choice.setting
    if entry is None:
        return '\n  * '.join([f'{name} {_too_slow(choice)}', *_remedies(choice, result)])
    sentences = [
        f'{name} `{parameters(entry)}`, {share_of_real_time(cost(entry))}.',
        f'Errors in the {result["reference"]["horizon"]:.2g} s for which they are known: '
        f'{length(error(entry))} from time step and precision, {_grid_error(choice.grid)}.',
        *_reasons(choice),
    ]
    if choice.grid_dominates:
        sentences += _finer(result)
    return '\n  * '.join(sentences)


def _reasons(choice: Choice) -> list[str]:
    """Return why it is none of the other settings."""
    reasons = []
    if choice.grid_dominates and choice.gainless is not None:
        reasons.append(
            "The grid's error dominates: a smaller tolerance or double precision costs more and "
            'gains nothing.'
        )
    elif choice.grid_dominates:
        reasons.append("The grid's error dominates.")
    elif choice.gainless is not None:
        reasons.append(
            'More accurate settings cost more and reduce the whole error by less than '
            f'{percent(recommendation.WORTH - 1)}.'
        )
    if choice.cheaper is not None:
        reasons.append(f'Cheaper settings are off by {length(error(choice.cheaper))} or more.')
    if choice.slower is not None:
        reasons.append(
            f'`{parameters(choice.slower)}` has an error of {length(error(choice.slower))}, but '
            f'takes more: {share_of_real_time(cost(choice.slower))}.'
        )
    return reasons


def _finer(result: Result) -> list[str]:
    """Return what a finer grid would cost, or why none is recommended."""
    finer = recommendation.finer_grids(result)
    best = recommendation.finer_grid(result)
    if best is not None:
        return [f'To be more accurate, take a finer grid: {_other_grid(best)}.']
    if finer and cost(finer[0]) > SHARE:
        return [f'The next finer grid takes more: {_other_grid(finer[0])}.']
    if finer:
        return [
            'Finer grids are not nearer to the finest one: this motion depends on every detail.'
        ]
    return []


def _too_slow(choice: Choice) -> str:
    """Return what the cheapest setting costs where none is fast enough."""
    text = f'no setting takes less than {percent(SHARE)} of real time with this scene.'
    if choice.slower is None:
        return text
    entry = choice.slower
    return (
        f'{text} The cheapest is `{parameters(entry)}`, {share_of_real_time(cost(entry))}. Its '
        f'errors: {length(error(entry))} from time step and precision, {_grid_error(choice.grid)}.'
    )


def _remedies(choice: Choice, result: Result) -> list[str]:
    """Return what would make a scene real time, with what it costs."""
    coarser = recommendation.coarser_grid(result)
    remedies = ['No grid that was measured is fast enough: take a coarser one.']
    if coarser is not None:
        remedies = [f'In real time: a coarser grid, {_other_grid(coarser)}.']
    if choice.slower is not None:
        softer = (cost(choice.slower) / SHARE) ** 2
        remedies.append(
            f'Or springs that are softer by a factor of {softer:.2g}: the cost is about '
            'proportional to the root of the stiffness.'
        )
    return [*remedies, 'Or slow motion, as it is (`solver.overload: slow_motion`).']


def _for_accuracy(result: Result) -> str:
    """Return the cheapest setting for a given accuracy on the grid, and what it is good for."""
    choice, cheap = recommendation.choose(result), recommendation.for_accuracy(result)
    name = f'**{length(ACCURACY)} from the exact solution on the same grid**:'
    if cheap is None:
        nearest = min(map(error, recommendation.usable(result)))
        return (
            f'{name} no tolerance that was measured is as accurate; the smallest error is '
            f'{length(nearest)}.'
        )
    if cheap is choice.setting:
        return f'{name} the same setting, error {length(error(cheap))}.'
    text = f'{name} `{parameters(cheap)}`, error {length(error(cheap))}, '
    text += f'{share_of_real_time(cost(cheap))}.'
    if choice.grid is not None and choice.grid.distance > ACCURACY:
        text += (
            ' Only for runs that are compared on one grid, or have to be repeatable: the grid is '
            f'off by {length(choice.grid.distance)} with any setting.'
        )
    return text


def _without_errors(result: Result) -> str:
    """Return what is known where no error is."""
    stable = [cost(entry) for entry in result['settings'] if not entry['unstable']]
    text = 'No error is known: the reference does not converge. '
    if stable:
        text += f'The cheapest stable setting: {share_of_real_time(min(stable))}. '
    return text + 'Keep the defaults.'


def _duration(result: Result) -> list[str]:
    """Return why the run, and the time for which errors are known, are short, if they are."""
    course, reference = result['course'], result['reference']
    seconds, horizon, lines = course['seconds'], reference['horizon'], []
    if course['limited']:
        lines.append(
            f'**Simulated time**: {seconds:.3g} s, not {course["wanted"]:.3g} s, because a run of '
            f'every setting would take about {course["expected"]:.0f} s for that. '
            f'`--seconds {course["wanted"]:g}` simulates all of it.'
        )
    if horizon < seconds * (1 - 1e-9):
        when = f'After {horizon:.2g} s' if horizon > 0 else 'From the start'
        text = f'**{when}** errors are not known: {_why_solutions_part(result)}'
        together = [entry['together'] for entry in recommendation.candidates(result)]
        if together and min(together) < seconds * (1 - 1e-9):
            text += (
                f' Settings stay within 1 % of the sheet of the reference for {min(together):.2g} '
                f's at least and {max(together):.2g} s at most; after that the defaults are as '
                'good as other settings.'
            )
        elif together:
            text += ' All settings stay within 1 % of the sheet of the reference to the end.'
        lines.append(text)
    return lines


def _why_solutions_part(result: Result) -> str:
    """Return why the reference has an end, as far as the run shows it."""
    course, reference = result['course'], result['reference']
    horizon, contact, gust = reference['horizon'], reference['contact'], course['gust at']
    apart = reference['apart']
    if not apart:
        finer = ' Without --quick the reference is finer.' if result['quick'] else ''
        return (
            'from there the reference is less than ten times as accurate as the most accurate '
            f'setting, although its two finest solutions stay within 0.1 mm.{finer}'
        )
    text = 'two reference solutions, one with twice the substeps of the other, part'
    if apart[-1]['time'] > apart[0]['time']:
        decades = math.log10(apart[-1]['distance'] / apart[0]['distance'])
        tenfold = (apart[-1]['time'] - apart[0]['time']) / decades
        text += f', and their distance grows tenfold every {tenfold:.2g} s'
    wind = any(result['parameters']['wind.velocity'])
    wind = wind and result['parameters']['wind.air_density'] > 0
    if contact is not None and contact <= horizon + _SAMPLES * course['period']:
        return (
            f'{text}. The sheet touches the sphere from {contact:.2g} s on, and the result of an '
            'impact depends on the substep in which each triangle touches.'
        )
    if gust is not None and gust <= horizon:
        return (
            f'{text}. A gust blows from {gust:.2g} s on: the motion of a cloth that flutters and '
            'folds is chaotic.'
        )
    moved = 'flutters in the wind' if wind else 'folds'
    return f'{text}. The motion of a cloth that {moved} is chaotic.'
