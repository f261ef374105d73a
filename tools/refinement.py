"""
Refinement study: how quantities of smooth motions converge as the grid is refined.

    python -m tools.refinement [--quick] [--out FOLDER]

Each case is one sheet on grids of 16² to 128² cells, whose spacing is halved from one to the next,
in double precision, through the public interface alone.  All grids have the same substeps, those
that the finest one needs, so that differences are those of the grid.  See the page for the cases
and for the stiffness on each grid.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.ticker import FixedLocator, NullLocator

from cloth_ros import Cloth, Scene
from cloth_ros.tradeoff.formatting import table
from cloth_ros.tradeoff.machine import describe_in_a_line

from .marked_block import fill, marks

NAME = 'make refinement'
FOLDER = Path('docs/validation')
# Cells along a side; the number of particles is one more, so that there is one in the centre.
CELLS = {True: (8, 16, 32), False: (16, 32, 64, 128)}

# Of the curves: told apart with any colour vision.
_MARKERS = 'osD^vP'
_COLOURS = ('#0072b2', '#b84a00', '#117733', '#aa4499', '#333333', '#7a6a00')

_RATE = 60.0  # Hz
# Length of the substeps of all grids, as a share of the stability limit of the finest one.
_SHARE = 0.4
_GRAVITY, _AIR = 9.81, 1.2
_SIZE, _MASS = 1.0, 0.2
# Softer than the defaults: the sag is some millimetres.
_SPRINGS = {'springs.structural': 100.0, 'springs.shear': 50.0, 'springs.bending': 10.0}
# Decay rate, 1/s, near the critical one of the slowest elastic mode: a sheet is at rest soonest.
_STRONG_DRAG = 100.0
# Change of a position, m, in a tenth of a second, below which a sheet counts as at rest, and the
# number of tenths after which that is given up.
_AT_REST, _TENTHS = 1e-10, 100
# Rows of particles along -z; the normal points along +y.
_CURTAIN = [-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
# Simulated time of the drop, s; of the ramp of the wind and until the end; and its speed, m/s.
_DROP, _RAMP, _FLOWN, _WIND = 0.3, 0.2, 0.3, 2.0
# Sag by its place, with the springs of `_SPRINGS` and without those over two cells.
_SAG = ('sag of the lower edge', 'sag of the centre')
_WITHOUT = ', no bending springs'

Values = dict[str, float]
Case = Callable[[int, int], Values]


@dataclass(frozen=True)
class Quantity:
    """
    A quantity of a case.

    Attributes
    ----------
    name, unit
        As in the table.
    resolved
        Difference, in `unit`, below which values count as equal: rounding, the time step, or how
        far from rest a sheet is.
    exact
        Value of the continuum; None: not known in closed form.

    """

    name: str
    unit: str
    resolved: float
    exact: float | None = None


def scene(cells: int, substeps: int, **changes: Any) -> Scene:
    """Return the sheet on a grid; two underscores in a name stand for the dot."""
    return Scene().with_parameters(
        {
            'rate': _RATE,
            'sheet.rows': cells + 1,
            'sheet.columns': cells + 1,
            'sheet.size': [_SIZE, _SIZE],
            'sheet.mass': _MASS,
            'sheet.position': [0.0, 0.0, 0.0],
            'wind.air_density': _AIR,
            'wind.drag_coefficient': 1.0,
            'solver.precision': 'double',
            'solver.substeps': substeps,
            **_SPRINGS,
            **{name.replace('__', '.'): value for name, value in changes.items()},
        }
    )


def _to_rest(cloth: Cloth) -> None:
    """Advance a cloth until it is at rest."""
    for _ in range(_TENTHS):
        before = cloth.positions
        cloth.advance(0.1)
        if np.abs(cloth.positions - before).max() < _AT_REST:
            return
    raise RuntimeError(f'the sheet is not at rest after {cloth.time:g} s')


def _hanging(cells: int, substeps: int, **changes: Any) -> Cloth:
    """Return a sheet that hangs at rest from its first row."""
    cloth = Cloth(scene(cells, substeps, pins=['0,:'], drag=_STRONG_DRAG, **changes))
    _to_rest(cloth)
    return cloth


def sag(cells: int, substeps: int) -> Values:
    """Return how far a hanging sheet is below an unloaded one, m."""
    found = {}
    for name, changes in (('', {}), (_WITHOUT, {'springs__bending': 0.0})):
        # In the plane of the world's x and y: it stays in it to the last bit.
        cloth = _hanging(cells, substeps, gravity=[0.0, _GRAVITY, 0.0], **changes)
        middle = cloth.positions[:, cells // 2, 1]
        sags = (middle[-1] - _SIZE / 2, middle[cells // 2])
        found |= {place + name: float(each) for place, each in zip(_SAG, sags, strict=True)}
    return found


def drop(cells: int, substeps: int) -> Values:
    """Return the fall of a flat free sheet in still air, m, and how flat it still is, m."""
    cloth = Cloth(scene(cells, substeps, pins=[''], drag=0.0))
    cloth.advance(_DROP)
    heights = cloth.positions[..., 2]
    return {
        'fall of the centre': -float(heights[cells // 2, cells // 2]),
        'greatest difference of heights': float(np.ptp(heights)),
    }


def flown(cells: int, substeps: int) -> Values:
    """Return how far even wind moves a sheet that hangs from its first row, m."""
    cloth = _hanging(cells, substeps, sheet__orientation=_CURTAIN)
    cloth.configure(cloth.scene.with_parameters({'drag': 0.0}))
    start = cloth.positions
    ticks = round(_FLOWN * _RATE)
    for tick in range(ticks):
        # Smooth in time; constant within a tick, and so the same on all grids.
        phase = min((tick + 0.5) / (_RAMP * _RATE), 1.0)
        cloth.wind = (0.0, _WIND * math.sin(0.5 * math.pi * phase) ** 2, 0.0)
        cloth.advance(1 / _RATE)
    moved = cloth.positions - start
    return {
        'displacement of the centre': float(np.linalg.norm(moved[cells // 2, cells // 2])),
        # Not the lower edge itself: it has no tension, and rounding makes folds there.
        'displacement halfway below it': float(np.linalg.norm(moved[3 * cells // 4, cells // 2])),
    }


def stability(cells: int, substeps: int) -> Values:
    """Return the longest stable substep / spacing, s/m."""
    cloth = Cloth(scene(cells, substeps))
    return {'stability limit / spacing': cloth.stability_limit * cells / _SIZE}


def _fall(seconds: float) -> float:
    """Return the fall of a flat sheet in still air, m."""
    terminal = math.sqrt(2 * _MASS * _GRAVITY / (_AIR * _SIZE**2))
    return terminal**2 / _GRAVITY * math.log(math.cosh(_GRAVITY * seconds / terminal))


CASES: dict[Case, tuple[Quantity, ...]] = {
    sag: tuple(Quantity(place + name, 'm', 1e-9) for name in ('', _WITHOUT) for place in _SAG),
    drop: (
        Quantity('fall of the centre', 'm', 1e-6, _fall(_DROP)),
        Quantity('greatest difference of heights', 'm', 1e-9, 0.0),
    ),
    flown: (
        Quantity('displacement of the centre', 'm', 1e-9),
        Quantity('displacement halfway below it', 'm', 1e-9),
    ),
    stability: (Quantity('stability limit / spacing', 's/m', 1e-12),),
}


@dataclass(frozen=True)
class Convergence:
    """
    A quantity on grids whose spacing is halved from one to the next.

    Attributes
    ----------
    quantity, cells, values
        What, on which grids, and how much on each.

    """

    quantity: Quantity
    cells: tuple[int, ...]
    values: tuple[float, ...]

    def _order(self, larger: float, smaller: float) -> float | None:
        """Return the order by which a difference shrinks when the spacing is halved."""
        resolved = self.quantity.resolved
        if abs(smaller) <= resolved:
            return math.inf if abs(larger) <= resolved else None
        return math.log2(larger / smaller) if larger / smaller > 0 else None

    @property
    def orders(self) -> list[float | None]:
        """
        Observed order of each two or three successive grids.

        From the errors on two where the exact value is known, otherwise from the values on three
        (Richardson).  Infinite: equal as far as is resolved; None: no regular convergence.
        """
        exact, values = self.quantity.exact, self.values
        if exact is None:
            differences = [b - a for a, b in itertools.pairwise(values)]
        else:
            differences = [value - exact for value in values]
        return [self._order(*pair) for pair in itertools.pairwise(differences)]

    @property
    def limit(self) -> float | None:
        """Exact value, or that extrapolated by the last order; None if there is no order."""
        order = self.orders[-1]
        if self.quantity.exact is not None:
            return self.quantity.exact
        if order is None or order <= 0:
            return None
        before, last = self.values[-2:]
        return last + (last - before) / (2**order - 1)


def measure(cells: Sequence[int]) -> Iterator[Convergence]:
    """Run all cases on all grids, and yield the convergence of each quantity."""
    finest = Cloth(scene(cells[-1], 0))
    substeps = math.ceil(1 / (_RATE * _SHARE * finest.stability_limit))
    for case, quantities in CASES.items():
        found = [case(number, substeps) for number in cells]
        for quantity in quantities:
            values = tuple(values[quantity.name] for values in found)
            yield Convergence(quantity, tuple(cells), values)


def _format_order(order: float | None) -> str:
    if order is None:
        return 'none'
    return 'exact' if math.isinf(order) else f'{order:.2f}'


def block(results: Sequence[Convergence]) -> str:
    """Return the generated part of the page."""
    rows = []
    for each in results:
        quantity, limit = each.quantity, each.limit
        error = '' if limit is None else f'{abs(each.values[-1] - limit):.2g}'
        kind = 'exact' if quantity.exact is not None else 'extrapolated'
        rows.append(
            (
                f'{quantity.name} [{quantity.unit}]',
                *(f'{value:.6g}' for value in each.values),
                'none' if limit is None else f'{limit:.6g} ({kind})',
                error,
                ', '.join(map(_format_order, each.orders)),
            )
        )
    cells = results[0].cells
    head = (
        'quantity',
        *(f'{number}² cells' for number in cells),
        'continuum',
        f'error at {cells[-1]}²',
        'observed order',
    )
    machine = describe_in_a_line()
    return (
        f'{table(head, rows)}\n\n'
        '![error against spacing](refinement.png)\n\n'
        f'Measured by `{NAME}` on: {machine}.'
    )


def draw(results: Sequence[Convergence], folder: Path) -> None:
    """Write ``refinement.png`` and ``.svg``: error of each quantity against the spacing."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 5.6), layout='constrained')
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    spacing = _SIZE / np.array(results[0].cells)
    looks = itertools.cycle(zip(_MARKERS, _COLOURS, strict=True))
    for each in results:
        if each.limit is None:
            continue
        error = np.abs(np.array(each.values) - each.limit)
        shown = error > each.quantity.resolved
        error /= abs(each.limit) or _SIZE
        if shown.any():
            last = next((order for order in reversed(each.orders) if order is not None), None)
            label = f'{each.quantity.name} (order {_format_order(last)})'
            marker, colour = next(looks)
            axes.loglog(
                spacing[shown], error[shown], f'{marker}-', color=colour, markersize=7, label=label
            )
    low, high = axes.get_ylim()
    for order in (1, 2):
        guide = high * (spacing / spacing[0]) ** order
        style = '--' if order == 1 else ':'
        axes.loglog(spacing, guide, style, color='#666666', label=f'slope of order {order}')
    axes.set_ylim(low, 2 * high)
    axes.set_xlabel('spacing [m]')
    axes.set_ylabel('relative error')
    axes.set_title('Convergence as the grid is refined', fontsize=11)
    axes.grid(True, which='both', color='#e4e4e4', linewidth=0.7)
    axes.xaxis.set_major_locator(FixedLocator(spacing))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(lambda value, _: f'{value:.3g}')
    axes.yaxis.set_major_formatter(
        lambda value, _: np.format_float_positional(value, precision=12, trim='-')
    )
    axes.figure.legend(loc='outside lower center', ncols=2, fontsize=9, frameon=False)
    for name in ('png', 'svg'):
        with matplotlib.rc_context({'svg.hashsalt': 'cloth_ros'}):
            metadata = {'Date': None} if name == 'svg' else None
            figure.savefig(folder / f'refinement.{name}', dpi=110, metadata=metadata)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, and write the table and the plot."""
    parser = argparse.ArgumentParser(prog='python -m tools.refinement', description=__doc__)
    parser.add_argument('--quick', action='store_true', help='8² to 32² cells')
    parser.add_argument('--out', metavar='FOLDER', type=Path, default=FOLDER)
    options = parser.parse_args(arguments)
    results = list(measure(CELLS[options.quick]))
    text = block(results)
    options.out.mkdir(parents=True, exist_ok=True)
    page = options.out / 'refinement.md'
    if not page.exists():
        page.write_text('# Refinement study\n\n{}\n{}\n'.format(*marks(NAME)))
    fill(page, NAME, text)
    draw(results, options.out)
    print(text)


if __name__ == '__main__':
    main()
