"""Work-precision plot of a scene: error of each setting against its cost."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.ticker import LogLocator, NullLocator

from . import recommendation

_COLOURS = {'position_verlet': '#1b6ca8', 'auto': '#3a7d44'}
_OTHER = '#6b4e71'
_NAMES = {'auto': 'substeps chosen by the solver, labelled with the tolerance in mm'}


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
        colour = _COLOURS.get(setting['method'], _OTHER)
        single = setting['precision'] == 'single'
        wall = entry['wall']
        spread = [[wall['median'] - wall['least']], [wall['greatest'] - wall['median']]]
        axes.errorbar(
            wall['median'],
            1e3 * recommendation.error(entry),
            xerr=spread,
            fmt='*' if setting['method'] == 'auto' else 'o',
            markersize=13 if setting['method'] == 'auto' else 7,
            color=colour,
            markerfacecolor=colour if single else 'white',
            elinewidth=1,
            alpha=0.4 if entry['refused'] else 1.0,
            zorder=3,
        )
    best = recommendation.frontier(recommendation.candidates(result))
    axes.plot(
        [recommendation.cost(entry) for entry in best],
        [1e3 * recommendation.error(entry) for entry in best],
        color='#888888',
        linewidth=5,
        alpha=0.35,
        zorder=1,
        label='frontier: no other setting is both cheaper and more accurate',
    )
    axes.set_xscale('log')
    axes.set_yscale('log')
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter('{x:g}')
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter('{x:g}')
    _mark_tolerances(axes, known)
    _mark_unstable(axes, result)
    _explain(axes, result)


def _mark_tolerances(axes: Any, known: list[dict[str, Any]]) -> None:
    """Label every star with its tolerances, mm."""
    stars: dict[tuple[str, float], list[dict[str, Any]]] = {}
    for entry in known:
        if entry['setting']['method'] == 'auto' and not entry['setting']['substeps']:
            key = (entry['setting']['precision'], recommendation.error(entry))
            stars.setdefault(key, []).append(entry)
    for (_, error), entries in stars.items():
        tolerances = sorted({1e3 * entry['setting']['tolerance'] for entry in entries})
        axes.annotate(
            ', '.join(f'{tolerance:g}' for tolerance in tolerances),
            (max(recommendation.cost(entry) for entry in entries), 1e3 * error),
            xytext=(6, 6),
            textcoords='offset points',
            color=_COLOURS['auto'],
            fontsize=8,
            zorder=4,
        )


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
    axes.axhline(high, color='#bbbbbb', linewidth=0.8, linestyle=':')
    axes.set_ylim(low, max(levels.values()) * (high / low) ** 0.05)


def _explain(axes: Any, result: dict[str, Any]) -> None:
    sheet = result['parameters']
    reference, scenario = result['reference'], result['course']
    for share, text in (
        (1.0, 'real time'),
        (recommendation.SHARE, f'{recommendation.SHARE:g} of real time'),
    ):
        axes.axvline(share, color='#444444', linewidth=share, linestyle='--')
        axes.annotate(
            text,
            (share, 0.01),
            xycoords=('data', 'axes fraction'),
            rotation=90,
            ha='right',
            va='bottom',
            fontsize=9,
            color='#444444',
        )
    low, high = axes.get_ylim()
    if low < 1e3 * recommendation.ACCURACY < high:
        axes.axhline(1e3 * recommendation.ACCURACY, color='#444444', linewidth=1, linestyle='--')
        axes.annotate(
            f'{1e3 * recommendation.ACCURACY:g} mm',
            (0.005, 1e3 * recommendation.ACCURACY),
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
    if any(entry['unstable'] for entry in result['settings']):
        axes.plot([], [], 'x', color='#444444', markersize=8, mew=2.2, label='blew up')
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
    axes.figure.legend(loc='outside lower center', ncols=3, fontsize=9, frameon=False)
