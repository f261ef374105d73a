"""The work-precision plot of a scene: what each setting costs, and how wrong it is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

from . import verdict

_COLOURS = {'position_verlet': '#1b6ca8', 'symplectic_euler': '#c8553d', 'auto': '#3a7d44'}
_OTHER = '#6b4e71'
_NAMES = {'auto': "the solver's own choice"}


def draw(result: dict[str, Any], folder: Path) -> None:
    """Write ``work_precision.png`` and ``.svg`` for the result of a study to `folder`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 6.2), layout='constrained')
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    known = [entry for entry in result['settings'] if entry['error'] is not None]
    for entry in known:
        setting = entry['setting']
        colour = _COLOURS.get(setting['method'], _OTHER)
        single = setting['precision'] == 'single'
        wall = entry['wall']
        spread = [[wall['median'] - wall['least']], [wall['greatest'] - wall['median']]]
        axes.errorbar(
            wall['median'],
            1e3 * verdict.error(entry),
            xerr=spread,
            fmt='*' if setting['method'] == 'auto' else 'o',
            markersize=13 if setting['method'] == 'auto' else 7,
            color=colour,
            markerfacecolor=colour if single else 'white',
            elinewidth=1,
            alpha=0.4 if entry['refused'] else 1.0,
            zorder=3,
        )
    best = verdict.frontier(verdict.candidates(result))
    axes.plot(
        [verdict.cost(entry) for entry in best],
        [1e3 * verdict.error(entry) for entry in best],
        color='#888888',
        linewidth=5,
        alpha=0.35,
        zorder=1,
        label='the frontier: nothing is cheaper and more accurate',
    )
    axes.set_xscale('log')
    axes.set_yscale('log')
    _mark_unstable(axes, result)
    _explain(axes, result)
    for name in ('png', 'svg'):
        with matplotlib.rc_context({'svg.hashsalt': 'cloth_ros'}):
            metadata = {'Date': None} if name == 'svg' else None
            figure.savefig(folder / f'work_precision.{name}', dpi=110, metadata=metadata)


def _mark_unstable(axes: Any, result: dict[str, Any]) -> None:
    """Show settings that blew up above all others, at what they would have cost."""
    unstable = [entry for entry in result['settings'] if entry['unstable']]
    if not unstable:
        return
    low, high = axes.get_ylim()
    level = high * (high / low) ** 0.08
    for entry in unstable:
        colour = _COLOURS.get(entry['setting']['method'], _OTHER)
        axes.plot(entry['nominal cost'], level, 'x', color=colour, markersize=9, mew=2.5)
    axes.axhline(high, color='#bbbbbb', linewidth=0.8, linestyle=':')
    axes.annotate(
        'blew up',
        (0.995, level),
        xycoords=('axes fraction', 'data'),
        ha='right',
        va='center',
        color='#666666',
        fontsize=9,
    )
    axes.set_ylim(low, level * (high / low) ** 0.06)


def _explain(axes: Any, result: dict[str, Any]) -> None:
    sheet = result['parameters']
    reference, course = result['reference'], result['course']
    axes.axvline(1.0, color='#444444', linewidth=1, linestyle='--')
    axes.annotate(
        'real time',
        (1.0, 0.01),
        xycoords=('data', 'axes fraction'),
        rotation=90,
        ha='right',
        va='bottom',
        fontsize=9,
        color='#444444',
    )
    low, high = axes.get_ylim()
    if low < 1e3 * verdict.ACCURACY < high:
        axes.axhline(1e3 * verdict.ACCURACY, color='#444444', linewidth=1, linestyle='--')
        axes.annotate(
            f'{1e3 * verdict.ACCURACY:g} mm',
            (0.005, 1e3 * verdict.ACCURACY),
            xycoords=('axes fraction', 'data'),
            va='bottom',
            fontsize=9,
            color='#444444',
        )
    for method in dict.fromkeys(entry['setting']['method'] for entry in result['settings']):
        axes.plot(
            [],
            [],
            '*' if method == 'auto' else 'o',
            color=_COLOURS.get(method, _OTHER),
            markersize=11 if method == 'auto' else 7,
            label=_NAMES.get(method, method.replace('_', ' ')),
        )
    axes.plot([], [], 'o', color='#444444', markersize=7, label='single precision')
    axes.plot([], [], 'o', color='#444444', markerfacecolor='white', markersize=7, label='double')
    axes.set_xlabel('cost: wall-clock seconds per simulated second (median and range)')
    axes.set_ylabel('largest position error [mm]')
    begins = f' from {course["begins at"]:g} s on' if course['begins at'] else ''
    axes.set_title(
        f'{result["scene"]}: {sheet["sheet.rows"]} × {sheet["sheet.columns"]} particles, '
        f'the first {reference["horizon"]:.3g} s{begins}\n'
        f'{result["machine"]["processor"]}, one core, {result["machine"]["vector instructions"]}',
        fontsize=10,
    )
    axes.grid(True, which='major', color='#e4e4e4', linewidth=0.7)
    axes.set_axisbelow(True)
    axes.figure.legend(loc='outside lower center', ncols=3, fontsize=9, frameon=False)
