"""Write the particles of a bag with a writer of meshes."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

from ..bag import Bag
from .mesh_writer import MeshWriter, Sheet
from .particle_history import Frames, ParticleHistory


def export(
    path: Path,
    node: str | None,
    make_writer: Callable[[Sheet], MeshWriter],
    start: float,
    end: float,
    fps: float,
    progress: Callable[[int, int], None],
) -> list[str]:
    """
    Write the recorded states of a cloth as frames; return what was done, in lines.

    Parameters
    ----------
    path
        Of the bag.
    node
        Full name of the node of the cloth; None: the only one.
    make_writer
        Makes the file.
    start, end, fps
        Which frames, see `Frames`.
    progress
        Called for each state with the number that was read, and of how many; 0: unknown.

    Raises
    ------
    ValueError
        The bag cannot be read, has no state in that time, or a sheet without faces.
    OSError
        The file cannot be written.

    """
    bag = Bag(path)
    history = ParticleHistory(bag, node)
    rate = fps or history.rate()
    writer: MeshWriter | None = None
    count, last = 0, 0.0
    frames = Frames(history.states(progress), start, end, fps)
    try:
        for frame in frames:
            if writer is None:
                rows, columns = history.grid
                if min(rows, columns) < 2:
                    raise ValueError(
                        f'the sheet has {rows} × {columns} particles and so no faces; record one '
                        'with two rows and two columns or more'
                    )
                writer = make_writer(Sheet(history.node.rpartition('/')[2], rows, columns, rate))
            writer.write(frame)
            count, last = count + 1, frame.time
    finally:
        if writer is not None:
            writer.close()
    if writer is None:
        span = f'from {start:g} s on' if math.isinf(end) else f'between {start:g} and {end:g} s'
        defects = ''.join(f'; {defect}' for defect in bag.defects)
        raise ValueError(
            f'{path} has no state of {history.node} {span} after the first one; give another '
            f'--start{defects}'
        )
    rows, columns = history.grid
    left_out = [f'{number} states left out: {why}' for why, number in history.left_out.items()]
    return [
        f'{count} frames of {rows} × {columns} particles, {last:.3f} s',
        *_jump_line(frames.jumps, start),
        *left_out,
        *bag.defects,
    ]


def _jump_line(jumps: list[tuple[float, float]], start: float) -> list[str]:
    """Return what is to be said of jumps of the clock: one line, or none."""
    if not jumps:
        return []
    (time, gap), more = jumps[0], len(jumps) - 1
    others = f', and {more} times more' if more else ''
    return [
        f'no state for {gap:.6g} s behind {time:.3f} s{others}: no frames there; '
        f'--end {start + time + 1:.0f} ends before it'
    ]
