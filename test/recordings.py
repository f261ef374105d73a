"""Recordings for tests, made without ROS: a live cloth whose ticks are written to a bag."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from cloth_ros import Scene
from cloth_ros.live.live_cloth import LiveCloth
from cloth_ros.recording.bag import TYPESTORE, Message
from cloth_ros.recording.output_bag import OutputBag

Act = Callable[[LiveCloth, int], None]
BEGIN = 10**18  # ns


def record(
    path: Path,
    scene: Scene,
    ticks: int,
    act: Act = lambda *_: None,
    *,
    keyframes: int = 600,
    node: str = '/cloth',
    estimate: float = 0.0,
) -> Path:
    """
    Record the ticks of a live cloth, as the node does; return the path.

    `act` is called before each tick, with its number from 1; keyframes are written at the first
    tick and after so many.  With `estimate`, s of wall-clock time after each tick, errors are
    estimated, and published in diagnostics.
    """
    live = LiveCloth(scene, logging.getLogger('test'))
    period = 1 / scene.rate
    bag = OutputBag(path, node, scene.frame_id)
    try:
        while live._start.missing:  # kernels, which a child process compiles
            live.poll()
        while estimate > 0 and live._estimator._current_fine() is None:
            time.sleep(0.05)  # the kernels of the finer solution
        for tick in range(1, ticks + 1):
            act(live, tick)
            assert live.tick(period, period=period, wall=1e9, estimate_error=estimate > 0)
            stamp = BEGIN + round(1e9 * period * tick)
            values = np.empty((scene.sheet.rows, scene.sheet.columns, 6), np.float32)
            live.write_particles(values)
            entry = live.record.take(stamp, stamp, live.time)
            restored = any(change.kind == 'restored' for change in entry.changes)
            bag.write_particles(stamp, values)
            bag.write_record(entry)
            if tick % keyframes == 1 or restored:
                bag.write_keyframe(live.keyframe(tick, stamp))
            if estimate > 0:
                live._estimator.work(estimate)
                bag.copy(_diagnostics_of(live, stamp, node))
        bag.write_scene(live.scene, BEGIN)
    finally:
        bag.close()
        live.close()
    return path


def diagnostics(
    stamp: int, now: float, age: float, window: float, error: float, node: str = '/cloth'
) -> Message:
    """Return diagnostics with an error estimate, as a node publishes them; `stamp` in ns."""
    values = {
        'simulated time [s]': now,
        'error estimate [m]': error,
        'error estimate, window [s]': window,
        'error estimate, age [s]': age,
    }
    return _message(stamp, values, node)


def _diagnostics_of(live: LiveCloth, stamp: int, node: str) -> Message:
    return _message(stamp, live.values(), node)


def _message(stamp: int, values: Mapping[str, object], node: str) -> Message:
    types = TYPESTORE.types
    make_value = types['diagnostic_msgs/msg/KeyValue']
    status = types['diagnostic_msgs/msg/DiagnosticStatus'](
        level=0,
        name=f'{node}: simulation',
        message='',
        hardware_id='',
        values=[  # numbers have six digits
            make_value(key=key, value=f'{value:.6g}' if isinstance(value, float) else str(value))
            for key, value in values.items()
        ],
    )
    seconds, nanoseconds = divmod(stamp, 10**9)
    stamped = types['builtin_interfaces/msg/Time'](sec=seconds, nanosec=nanoseconds)
    header = types['std_msgs/msg/Header'](stamp=stamped, frame_id='')
    kind = 'diagnostic_msgs/msg/DiagnosticArray'
    message = types[kind](header=header, status=[status])
    return Message('/diagnostics', kind, stamp, bytes(TYPESTORE.serialize_cdr(message, kind)))
