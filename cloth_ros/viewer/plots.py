"""Live plots of what a cloth reports: energy, real-time factor, error estimate."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np
import viser
from viser import uplot

from .cloth_client import ClothClient
from .history import History

SECONDS = 120.0  # shown


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
    top
        Value up to which the vertical axis reaches from 0 at least; None: as far as the values.

    """

    key: str
    title: str
    factor: float
    colour: str
    top: float | None = None


QUANTITIES = (
    Quantity('real-time factor', 'real-time factor', 1.0, '#1b7a5a', 1.2),
    Quantity('energy [J]', 'energy, J', 1.0, '#b3541e'),
    Quantity('error estimate [m]', 'error estimate, mm', 1e3, '#3b5bdb', 0.0),
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
                plot.data = history.curve(now)


def _plot(gui: viser.GuiApi, quantity: Quantity) -> viser.GuiUplotHandle:
    axis = {'size': 46, 'font': '11px system-ui', 'ticks': {'size': 4}, 'stroke': '#666'}
    vertical = uplot.Scale(auto=True)
    if quantity.top is not None:
        lower = {'pad': 0.0, 'soft': 0.0, 'hard': 0.0, 'mode': 1}
        limits = {'min': lower, 'max': {'pad': 0.1, 'soft': quantity.top, 'mode': 1}}
        vertical = uplot.Scale(auto=True, range=limits)
    below = {**axis, 'size': 24, 'label': 'time, s', 'labelSize': 16, 'labelFont': axis['font']}
    return gui.add_uplot(
        (np.array([-SECONDS]), np.array([0.0])),
        (
            uplot.Series(label='s'),
            uplot.Series(label=quantity.title, stroke=quantity.colour, width=2),
        ),
        title=quantity.title,
        scales={'x': uplot.Scale(time=False, range=(-SECONDS, 0.0)), 'y': vertical},
        axes=(uplot.Axis(**below), uplot.Axis(**axis)),  # type: ignore[typeddict-item]
        legend=uplot.Legend(show=False),
        height=165,
        padding=(8, 14, 0, 0),
    )
