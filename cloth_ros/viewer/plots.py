"""Live plots of what a cloth reports: energy, real-time factor, error estimate."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
import viser
from numpy.typing import NDArray
from viser import uplot

from .cloth_client import ClothClient
from .history import History

SECONDS = 120.0  # shown


_NO_POINTS = uplot.Series_Points(show=False)


class Quantity(NamedTuple):
    """
    A plot.

    Attributes
    ----------
    key
        Of the diagnostics.
    title
        With the unit that is shown.
    factor
        From the unit of the diagnostics to that of the plot.
    colour
        Of the line.
    marks
        Values that the vertical axis always includes; all but 0 are drawn as dashed lines.

    """

    key: str
    title: str
    factor: float
    colour: str
    marks: tuple[float, ...] = ()


QUANTITIES = (
    Quantity('real-time factor', 'real-time factor', 1.0, '#1b7a5a', (0.0, 1.0)),
    Quantity('energy [J]', 'energy, J', 1.0, '#b3541e', (0.0,)),
    Quantity('error estimate [m]', 'error estimate, µm', 1e6, '#3b5bdb', (0.0,)),
)


class Plots:
    """
    Plots of one cloth.

    Parameters
    ----------
    gui
        Of the page.
    client
        The cloth.

    """

    def __init__(self, gui: viser.GuiApi, client: ClothClient) -> None:
        self._client = client
        self._reports = 0
        self._plots = [(each, History(SECONDS), _plot(gui, each)) for each in QUANTITIES]

    def update(self) -> None:
        """Add the newest report, if there is one."""
        if self._client.reports == self._reports:
            return
        self._reports = self._client.reports
        now = time.monotonic()
        for quantity, history, plot in self._plots:
            history.add(now, quantity.factor * self._client.number(quantity.key))
            if len(history):
                plot.data = _data(quantity, *history.curve(now))


def _plot(gui: viser.GuiApi, quantity: Quantity) -> viser.GuiUplotHandle:
    axis = {'size': 46, 'font': '11px system-ui', 'ticks': {'size': 4}, 'stroke': '#666'}
    below = {**axis, 'size': 24, 'label': 'time, s', 'labelSize': 16, 'labelFont': axis['font']}
    return gui.add_uplot(
        _data(quantity, np.array([-SECONDS]), np.array([1.0])),
        (
            uplot.Series(label='s'),
            uplot.Series(label=quantity.title, stroke=quantity.colour, width=2, points=_NO_POINTS),
            *(_mark(value) for value in quantity.marks),
        ),
        title=quantity.title,
        scales={'x': uplot.Scale(time=False), 'y': uplot.Scale(auto=True)},
        axes=(uplot.Axis(**below), uplot.Axis(**axis)),  # type: ignore[typeddict-item]
        legend=uplot.Legend(show=False),
        height=165,
        padding=(8, 14, 0, 0),
    )


def _data(
    quantity: Quantity, times: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], ...]:
    return times, values, *(np.full_like(times, mark) for mark in quantity.marks)


def _mark(value: float) -> uplot.Series:
    if value == 0.0:
        return uplot.Series(label='0', width=0, points=_NO_POINTS)
    return uplot.Series(label=f'{value:g}', stroke='#999', width=1, dash=(4, 4), points=_NO_POINTS)
