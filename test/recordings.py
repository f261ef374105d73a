"""Recordings for tests, made without ROS: a live cloth whose ticks are written to a bag."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cloth_ros import Scene
from cloth_ros.live.live_cloth import LiveCloth
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
) -> Path:
    """
    Record the ticks of a live cloth, as the node does; return the path.

    `act` is called before each tick, with its number from 1; keyframes are written at the first
    tick and after so many.
    """
    live = LiveCloth(scene, logging.getLogger('test'))
    period = 1 / scene.rate
    bag = OutputBag(path, node, scene.frame_id)
    try:
        while live._start.missing:  # kernels, which a child process compiles
            live.poll()
        for tick in range(1, ticks + 1):
            act(live, tick)
            assert live.tick(period, period=period, wall=1e9)
            stamp = BEGIN + round(1e9 * period * tick)
            values = np.empty((scene.sheet.rows, scene.sheet.columns, 6), np.float32)
            live.write_particles(values)
            entry = live.record.take(stamp, stamp, live.time)
            restored = any(change.kind == 'restored' for change in entry.changes)
            bag.write_particles(stamp, values)
            bag.write_record(entry)
            if tick % keyframes == 1 or restored:
                bag.write_keyframe(live.keyframe(tick, stamp))
        bag.write_scene(live.scene, BEGIN)
    finally:
        bag.close()
        live.close()
    return path
