"""Plot of the error of a recorded run over time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from .error_history import ErrorEntry
from .resimulation import Resimulation

# Colours that people with any colour vision tell apart.
_LARGEST, _RMS = '#b84a00', '#0072b2'


def draw(run: Resimulation, title: str, path: Path) -> None:
    """Write a plot (PNG) of the error of the recorded run against a new one."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 4.8), layout='constrained')
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    entries = run.history.entries
    _line(axes, entries, 'largest', 'largest error of any particle', _LARGEST)
    _line(axes, entries, 'rms', 'root mean square of all particles', _RMS)
    for number, time in enumerate(run.history.resets):
        label = 'reset' if number == 0 else None
        axes.axvline(time, color='#777777', linestyle=':', label=label)
    axes.set_yscale('log')
    axes.set_xlabel('simulated since the beginning [s]')
    axes.set_ylabel('distance from the new run [mm]')
    axes.set_title(title, fontsize='medium')
    axes.yaxis.set_major_formatter('{x:g}')
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=110)


def _line(axes: Any, entries: list[ErrorEntry], name: str, label: str, colour: str) -> None:
    errors = np.array([1e3 * getattr(entry, name) for entry in entries])
    errors[errors == 0] = np.nan  # has no place on a logarithmic axis
    axes.plot([entry.time for entry in entries], errors, color=colour, label=label)
