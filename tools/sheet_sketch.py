"""
Sketch of where the rows and columns of a sheet lie, for docs/howto/scene.md.

    python -m tools.sheet_sketch

Drawn from the initial state of a `Cloth`, so that it shows what the model does.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from cloth_ros import Cloth, Scene
from cloth_ros.scene.quaternion import rotation_matrix

_PATH = Path(__file__).parent.parent / 'docs' / 'pictures' / 'sheet.svg'
_ROWS, _COLUMNS = 5, 7
_ROW, _COLUMN, _NORMAL = '#0072b2', '#d55e00', '#117733'  # told apart by the colour-blind, too
_UPRIGHT = (-(0.5**0.5), 0.0, 0.0, 0.5**0.5)
# Where x, y and z of the world point to in the sketch.
_PROJECTION = np.array([[0.94, -0.2], [0.5, 0.45], [0.0, 0.9]])
# Offsets of the labels of the corners, in points.
_SIDES = {(0, 0): (-1, -1), (0, -1): (1, -1), (-1, 0): (-1, 1), (-1, -1): (1, 1)}


def _arrow(axes: Any, start: np.ndarray, end: np.ndarray, colour: str, name: str) -> None:
    a, b = start @ _PROJECTION, end @ _PROJECTION
    arrow = {'arrowstyle': '-|>', 'color': colour, 'linewidth': 1.6, 'shrinkA': 0, 'shrinkB': 0}
    axes.annotate('', b, a, arrowprops=arrow)
    axes.text(*(b + 0.1 * (b - a) / np.linalg.norm(b - a)), name, color=colour, **_CENTRED)


_CENTRED = {'ha': 'center', 'va': 'center', 'fontsize': 11}


def _draw(axes: Any, orientation: tuple[float, ...], title: str) -> None:
    sheet = {'rows': _ROWS, 'columns': _COLUMNS, 'size': (1.2, 0.8), 'orientation': orientation}
    upright = orientation == _UPRIGHT
    cloth = Cloth(Scene(sheet={**sheet, 'position': (0.0, 0.0, 0.0)}, pins=['']))
    flat = cloth.positions @ _PROJECTION
    for lines in (flat, flat.swapaxes(0, 1)):
        for line in lines:
            axes.plot(*line.T, color='#999999', linewidth=0.8, zorder=1)
    axes.plot(*flat[0].T, 'o-', color=_ROW, linewidth=3, markersize=6, zorder=3)
    axes.plot(*flat[1:, 0].T, 's', color=_COLUMN, markersize=6, zorder=3)
    axes.plot(*flat[:, 0].T, '--', color=_COLUMN, linewidth=3, zorder=2)
    for (row, column), (right, up) in _SIDES.items():
        up = -up if upright else up
        axes.annotate(
            f'"{row},{column}"', flat[row, column], (16 * right, 11 * up),
            textcoords='offset points', fontsize=9, color='#222222', ha='center', va='center',
        )  # fmt: skip
    middle = cloth.positions[_ROWS // 2 + upright, _COLUMNS // 2]
    normal = rotation_matrix(np.array(orientation)) @ (0.0, 0.0, 0.3)
    _arrow(axes, middle, middle + normal, _NORMAL, 'normal')
    corner = np.array([-1.15, -0.15, -0.65])
    for axis, name in enumerate('xyz'):
        _arrow(axes, corner, corner + 0.3 * np.eye(3)[axis], '#222222', name)
    axes.set_title(title, fontsize=10, color='#222222', pad=2)
    axes.set(aspect='equal', xlim=(-1.35, 0.95), ylim=(-0.62, 0.75))
    axes.set_axis_off()


def main() -> None:
    """Write the sketch."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 3.7), layout='constrained', facecolor='white')
    left, right = figure.subplots(1, 2)
    _draw(left, (0.0, 0.0, 0.0, 1.0), 'sheet.orientation: [0, 0, 0, 1]\nrows along +y, columns +x')
    _draw(right, _UPRIGHT, 'sheet.orientation: [-0.7071, 0, 0, 0.7071]\nrows down, columns +x')
    left.plot([], [], 'o-', color=_ROW, linewidth=3, label='row 0: pins ["0,:"]')
    left.plot([], [], 's--', color=_COLUMN, linewidth=3, label='column 0: pins [":,0"]')
    figure.legend(loc='outside lower center', ncols=2, fontsize=10, frameon=False)
    with matplotlib.rc_context({'svg.hashsalt': 'cloth_ros'}):
        figure.savefig(_PATH, metadata={'Date': None})


if __name__ == '__main__':
    main()
