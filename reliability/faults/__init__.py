"""
What the running node outlives, on real processes.

The short form of a fault is for tests, on machines that may be busy: what it promises of rates is
not judged then.
"""

from __future__ import annotations

from collections.abc import Callable

from ..live import Live
from ..record import Row
from .clocks import clock_jumps, clock_stands, system_clock
from .graph import flood, hog, namesakes, parameters, stopped
from .starts import changing, compiling, log_folder, loopback, signals
from .subscribers import crowd, hung_subscriber, killed_subscriber

# A sphere that takes part, out of reach of the cloth, for what is commanded.
SCENE = ('-p', 'sphere.radius:=0.1', '-p', 'sphere.position:=[0.0, 0.0, -5.0]')

# On one node, one after the other: what one does to it is there for the next.
SHARED: tuple[Callable[[Live, bool], Row], ...] = (
    stopped,
    flood,
    parameters,
    hog,
    clock_jumps,
    clock_stands,
    namesakes,
)
ALONE: tuple[Callable[[bool], Row], ...] = (
    hung_subscriber,
    killed_subscriber,
    crowd,
    system_clock,
    loopback,
    log_folder,
    signals,
    compiling,
    changing,
)
