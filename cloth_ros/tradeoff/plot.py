"""Work-precision plot of a scene: error of each setting against its cost."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.patheffects import withStroke
from matplotlib.ticker import LogLocator, NullFormatter, NullLocator
from matplotlib.transforms import Bbox

from . import recommendation

# Colours that people with any colour vision tell apart; marks differ in shape, too.
_COLOURS = {'position_verlet': '#0072b2', 'auto': '#b84a00'}
_AT_BOUND = '#00785a'
_OTHER = '#6b4e71'
_REFUSED = 0.4  # opacity
# Where a label may lie beside its mark, in points, in the order of preference.
_SIDES = ((1, 1), (1, -1), (-1, 1), (-1, -1), (0, 1), (0, -1))
_PLACES = [(distance * x, distance * y) for distance in (10, 16, 24) for x, y in _SIDES]
_CLEARANCE = 6  # points, around marks
_NAMES = {'auto': 'substeps of the solver; beside it: tolerance [mm]'}


def draw(result: dict[str, Any], folder: Path) -> None:
    """Write ``work_precision.png`` and ``.svg`` for the result of a study to `folder`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 6.2), layout='constrained')
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    known = [
        entry
        for entry in result['settings']
        if entry['error'] is not None and recommendation.error(entry) > 0
    ]
    if known:
        _draw_known(axes, known, result)
    else:
        axes.text(0.5, 0.5, 'no errors: the reference does not converge', ha='center')
        axes.set_axis_off()
    for name in ('png', 'svg'):
        with matplotlib.rc_context({'svg.hashsalt': 'cloth_ros'}):
            metadata = {'Date': None} if name == 'svg' else None
            figure.savefig(folder / f'work_precision.{name}', dpi=110, metadata=metadata)


def _draw_known(axes: Any, known: list[dict[str, Any]], result: dict[str, Any]) -> None:
    for entry in known:
        setting = entry['setting']
        mark, size, colour = _style(entry)
        single = setting['precision'] == 'single'
        wall = entry['wall']
        spread = [[wall['median'] - wall['least']], [wall['greatest'] - wall['median']]]
        axes.errorbar(
            wall['median'],
            1e3 * recommendation.error(entry),
            xerr=spread,
            fmt=mark,
            markersize=size,
            color=colour,
            markerfacecolor=colour if single else 'white',
            elinewidth=1,
            alpha=_REFUSED if entry['refused'] else 1.0,
            zorder=3,
        )
    _join_pairs(axes, result)
    best = recommendation.frontier(recommendation.candidates(result))
    axes.plot(
        [recommendation.cost(entry) for entry in best],
        [1e3 * recommendation.error(entry) for entry in best],
        color='#888888',
        linewidth=5,
        alpha=0.35,
        zorder=1,
        label='frontier: no other is cheaper and more accurate',
    )
    axes.set_xscale('log')
    axes.set_yscale('log')
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter('{x:g}')
    axes.xaxis.set_minor_locator(NullLocator())
    low, high = axes.get_ylim()
    if high < 100 * low:
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(
        lambda value, _: np.format_float_positional(value, precision=12, trim='-')
    )
    axes.yaxis.set_minor_formatter(NullFormatter())
    _mark_unstable(axes, result)
    _explain(axes, result)
    axes.figure.draw_without_rendering()  # the places of the marks are known now
    _mark_tolerances(axes, known)


def _style(entry: dict[str, Any]) -> tuple[str, float, str]:
    """Return mark, its size in points, and colour of a setting."""
    method = entry['setting']['method']
    if not recommendation.follows_state(entry):
        return 'D', 7.0, _AT_BOUND
    colour = _COLOURS.get(method, _OTHER)
    return ('*', 13.0, colour) if method == 'auto' else ('o', 7.0, colour)


def _join_pairs(axes: Any, result: dict[str, Any]) -> None:
    """Join settings that differ only in whether substeps follow the state."""
    for entry in result['settings']:
        other = recommendation.without_following(entry, result)
        if other is None or other is entry or not (entry['error'] and other['error']):
            continue
        axes.plot(
            [recommendation.cost(each) for each in (other, entry)],
            [1e3 * recommendation.error(each) for each in (other, entry)],
            color=_AT_BOUND, linewidth=1, zorder=2,
        )  # fmt: skip


def _mark_tolerances(axes: Any, known: list[dict[str, Any]]) -> None:
    """Label every star with its tolerances, mm."""
    stars: dict[tuple[str, float], list[dict[str, Any]]] = {}
    for entry in known:
        setting = entry['setting']
        automatic = setting['method'] == 'auto' and not setting['substeps']
        if automatic and recommendation.follows_state(entry):
            key = (entry['setting']['precision'], recommendation.error(entry))
            stars.setdefault(key, []).append(entry)
    occupied = [box for entry in known for box in _boxes(axes, entry)]
    for (_, error), entries in stars.items():
        tolerances = sorted({1e3 * entry['setting']['tolerance'] for entry in entries})
        last = max(entries, key=recommendation.cost)
        label = axes.annotate(
            ', '.join(f'{tolerance:g}' for tolerance in tolerances),
            (last['wall']['median'], 1e3 * error),
            xytext=_PLACES[0],
            textcoords='offset points',
            ha='center',
            va='center',
            color=_COLOURS['auto'],
            fontsize=8,
            path_effects=[withStroke(linewidth=2, foreground='white')],
            zorder=4,
        )
        for place in _PLACES:
            label.set_position(place)
            box = label.get_window_extent()
            if box.count_overlaps(occupied) == 0 and axes.bbox.containsx(box.x1):
                break
        occupied.append(label.get_window_extent())


def _boxes(axes: Any, entry: dict[str, Any]) -> Iterator[Bbox]:
    """Yield the areas that the mark and the range of a setting take, in pixels."""
    margin = _CLEARANCE * axes.figure.dpi / 72
    error, wall = 1e3 * recommendation.error(entry), entry['wall']
    for first, last, half in (
        (wall['median'], wall['median'], margin),
        (wall['least'], wall['greatest'], margin / 4),
    ):
        left, y = axes.transData.transform((first, error))
        right, _ = axes.transData.transform((last, error))
        yield Bbox([[left - half, y - half], [right + half, y + half]])


def _mark_unstable(axes: Any, result: dict[str, Any]) -> None:
    """Mark settings that blew up above all others, at their expected cost."""
    unstable = [entry for entry in result['settings'] if entry['unstable']]
    if not unstable:
        return
    low, high = axes.get_ylim()
    levels = {
        method: high * (high / low) ** (0.06 + 0.05 * n)
        for n, method in enumerate(dict.fromkeys(each['setting']['method'] for each in unstable))
    }
    for entry in unstable:
        method = entry['setting']['method']
        colour, level = _COLOURS.get(method, _OTHER), levels[method]
        axes.plot(entry['nominal cost'], level, 'x', color=colour, markersize=8, mew=2.2)
    axes.axhline(high, color='#777777', linewidth=0.8, linestyle=':')
    axes.set_ylim(low, max(levels.values()) * (high / low) ** 0.05)


def _explain(axes: Any, result: dict[str, Any]) -> None:
    sheet = result['parameters']
    reference, scenario = result['reference'], result['course']
    lines = {'color': '#444444', 'linewidth': 1}
    axes.axvline(1.0, linestyle='--', label='real time', **lines)
    share = recommendation.SHARE
    axes.axvline(share, linestyle='-.', label=f'{share:g} of real time', **lines)
    low, high = axes.get_ylim()
    if low < 1e3 * recommendation.ACCURACY < high:
        accuracy = f'{1e3 * recommendation.ACCURACY:g} mm'
        axes.axhline(1e3 * recommendation.ACCURACY, linestyle=(0, (8, 3)), label=accuracy, **lines)
    for method in dict.fromkeys(entry['setting']['method'] for entry in result['settings']):
        axes.plot(
            [],
            [],
            '*' if method == 'auto' else 'o',
            color=_COLOURS.get(method, _OTHER),
            markersize=11 if method == 'auto' else 7,
            label=_NAMES.get(method, method.replace('_', ' ')),
        )
    if not all(map(recommendation.follows_state, result['settings'])):
        axes.plot(
            [], [], 'D-', color=_AT_BOUND, markersize=7, linewidth=1,
            label='substeps fixed at the bound',
        )  # fmt: skip
    for colour, precision in (('#444444', 'single'), ('white', 'double')):
        axes.plot(
            [], [], 'o', color='#444444', markerfacecolor=colour, markersize=7,
            label=f'{precision} precision',
        )  # fmt: skip
    if any(entry['unstable'] for entry in result['settings']):
        axes.plot([], [], 'x', color='#444444', markersize=8, mew=2.2, label='blew up')
        axes.plot([], [], ':', color='#777777', linewidth=0.8, label='above: no error is known')
    if any(entry['refused'] for entry in result['settings'] if entry['error'] is not None):
        axes.plot(
            [], [], 'o', color='#444444', alpha=_REFUSED, markersize=7, label='refused by the node'
        )
    axes.plot([], [], '-', color='#444444', linewidth=1, label='range of the runs')
    axes.set_xlabel('cost: wall-clock seconds per simulated second (median and range)')
    axes.set_ylabel('largest position error [mm]')
    begins = f' after {scenario["begins at"]:g} s' if scenario['begins at'] else ''
    axes.set_title(
        f'{result["scene"]}: {sheet["sheet.rows"]} × {sheet["sheet.columns"]} particles, '
        f'errors of the first {reference["horizon"]:.3g} s{begins}\n'
        f'{result["machine"]["processor"]}, one core, {result["machine"]["vector instructions"]}',
        fontsize=10,
    )
    axes.grid(True, which='major', color='#e4e4e4', linewidth=0.7)
    axes.set_axisbelow(True)
    axes.figure.legend(loc='outside lower center', ncols=3, fontsize=8.5, frameon=False)
