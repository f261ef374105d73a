"""
Published results of other programs, and those of this package for the same systems.

The elastic pendulum is the exam of a course on numerical methods, whose solution lists the
position of a mass on a spring after 1000 s for several steps and initial positions (course
PHYD57, University of Toronto Scarborough, 2024,
http://planets.utsc.utoronto.ca/~pawel/PHYD57/fin-prob1-2024.res).  Its second-order scheme is
leapfrog, which is position Verlet from a start that differs by half a step.

The folded chain hangs from both ends, side by side, and one end is released.  Energy is
conserved, ẏ² = g (2 L y − y²)/(L − y) for the drop y of the free end (M. G. Calkin, R. H. March,
"The dynamics of a falling chain. I", Am. J. Phys. 57, 1989, 154), and the chain falls its length L
in ½ B(¾, ½)/√2 = 0.8472 of the time of free fall.  That is the limit of infinitely many links,
extrapolated here from two numbers of links in their inverse.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..model import Cloth
from .analytic_cases import scene

_GRAVITY = 9.81  # m/s²


@dataclass(frozen=True)
class Published:
    """
    A published result.

    Attributes
    ----------
    name
        Of the system, with its parameters.
    parameter
        Names and units of the values.
    values
        As published.
    tolerance
        Differences that rounding of the published digits and an unknown start explain.
    steps
        Approximate number of substeps of the simulation.
    run
        Simulates the system and returns the same quantities.

    """

    name: str
    parameter: str
    values: tuple[float, ...]
    tolerance: tuple[float, ...]
    steps: float
    run: Callable[[], tuple[float, ...]]


def _pendulum(method: str, step: float, y: float, stiffness: float) -> tuple[float, ...]:
    """Return x, y, z and length, m, and the size of the relative change of energy."""
    rest, rate = 0.1, 1000.0
    cloth = Cloth(
        scene(
            method,
            sheet__rows=1,
            sheet__columns=2,
            sheet__size=[rest, 1.0],
            sheet__mass=2.0,
            sheet__position=[rest / 2, 0.0, 0.0],
            pins=['0,0'],
            springs__structural=stiffness,
            rate=rate,
            solver__substeps=round(1 / (rate * step)),
        )
    )
    cloth.positions = np.array([[[0.0, 0.0, 0.0], [-0.1, y, 0.1]]])
    cloth.velocities = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, -0.1]]])
    before = cloth.energy()
    cloth.advance(1000.0)
    position = cloth.positions[0, 1]
    return (*position.tolist(), float(np.linalg.norm(position)), abs(cloth.energy() / before - 1))


@functools.cache
def falling_time(links: int, stiffness: float = 1e6) -> float:
    """Return the time of fall of a folded chain / that of free fall by its length."""
    length = 1.0
    cloth = Cloth(
        scene(
            'auto',
            sheet__rows=1,
            sheet__columns=links + 1,
            sheet__size=[length, 1.0],
            pins=['0,0'],
            springs__structural=stiffness,
        )
    )
    # One horizontal link connects two arms of the same number of links.
    link = length / links
    arm = np.arange((links + 1) // 2)
    x = np.repeat([0.0, link], len(arm))
    z = -link * np.concatenate([arm, arm[::-1]])
    cloth.positions = np.stack([x, 0 * x, z], -1)[None]
    tick, before, after = 1e-3, 0.0, 0.0
    while after <= 0:  # until the end moves upward
        cloth.advance(tick)
        before, after = after, float(cloth.velocities[0, -1, 2])
    time = cloth.time - tick * after / (after - before)
    return time / math.sqrt(2 * length / _GRAVITY)


def _folded_chain() -> tuple[float, ...]:
    few, many = 41, 81
    fewer, more = falling_time(few), falling_time(many)
    return ((many * more - few * fewer) / (many - few),)


def _rows() -> list[Published]:
    """Return the rows of the published table of the elastic pendulum."""
    table = (
        (1e-3, 0.2, 33.0, (-0.0501, 0.1003, 0.0742, 0.1340, 0.344e-5)),
        (5e-4, 0.2, 33.0, (-0.0497, 0.0995, 0.0747, 0.1338, 0.861e-6)),
        (1e-3, 0.21, 33.0, (0.0915, -0.1921, -0.6548, 0.6904, 0.708e-5)),
    )
    return [
        Published(
            f'elastic pendulum, y₀ = {y:g} m, k/m = {stiffness:g}/s², {1e3 * step:g} ms',
            'x, y, z, length [m], size of the relative change of energy',
            values,
            # Four digits of the position are printed; the exact start is not given.
            (*[1.5e-3] * 4, 0.005 * values[-1]),
            1000 / step,
            partial(_pendulum, 'position_verlet', step, y, stiffness),
        )
        for step, y, stiffness, values in table
    ]


FIGURES = (
    *_rows(),
    Published('folded chain', 'time of fall / free fall', (0.85,), (5e-3,), 1e5, _folded_chain),
)
