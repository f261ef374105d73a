"""Simulate a recorded session again with another scene, and measure the error of the recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..live.keyframe import INTERVAL
from ..live.tick_record import CONFIGURED, RESET
from ..model import check_scene
from ..model.resample import resample_scene
from ..scene import Scene
from .bag import Message
from .comparison import gap_text
from .error_history import ErrorHistory
from .output_bag import OutputBag
from .recorded_cloth import RecordedCloth
from .repeated_cloth import OtherCloth
from .timeline import Entry, Gap, Start, Step


@dataclass(frozen=True)
class Settings:
    """
    How to simulate a session again.

    Attributes
    ----------
    parameters
        Those that differ from the recorded scene, by name.
    refinement
        Divisor of the spacing of the grid; or its rows and columns.
    errors
        Whether to write the error of each particle to the new bag.

    """

    parameters: Mapping[str, Any] = field(default_factory=dict)
    refinement: float | tuple[int, int] = 1.0
    errors: bool = False

    def scene(self, recorded: Scene) -> Scene:
        """Return the scene to simulate for a recorded one; raises ValueError."""
        scene = recorded.with_parameters(self.parameters)
        factor = self._factor(scene)
        finer = resample_scene(scene, factor)
        if finer is None:
            raise ValueError(
                f'--grid is {self._grid}, but a side must have 3 to 512 particles, and '
                'pins that can be written; choose a grid nearer to the recorded one'
            )
        check_scene(finer)
        return finer

    @property
    def _grid(self) -> str:
        """The grid as it is given on the command line."""
        if isinstance(self.refinement, tuple):
            return 'x'.join(str(count) for count in self.refinement)
        return f'{self.refinement:g}'

    def _factor(self, scene: Scene) -> float:
        """Return the divisor of the spacing; raises ValueError if its sides have several."""
        if not isinstance(self.refinement, tuple):
            return self.refinement
        (new, other), sides = self.refinement, (scene.sheet.rows, scene.sheet.columns)
        factor = (new - 1) / (sides[0] - 1) if sides[0] > 1 else (other - 1) / max(sides[1] - 1, 1)
        wanted = tuple(round((side - 1) * factor) + 1 for side in sides)
        if wanted != self.refinement:
            raise ValueError(
                f'--grid is {self._grid}, but the spacing must change alike along both sides of '
                f'{sides[0]} × {sides[1]} particles; write {wanted[0]}x{wanted[1]}'
            )
        return factor


class Resimulation:
    """
    A new run beside the recorded one.

    Parameters
    ----------
    settings
        How to simulate.
    folder
        Where to write ``error.csv`` and the new bag; it exists.
    recorded
        The recorded cloth.

    Attributes
    ----------
    history
        Error of the recorded run.
    gaps
        Ticks that were lost by the recorder, in words.

    """

    def __init__(self, settings: Settings, folder: Path, recorded: RecordedCloth) -> None:
        self._settings, self._folder, self._recorded = settings, folder, recorded
        self._other = OtherCloth(settings.scene)
        self._bag: OutputBag | None = None
        self._early: list[Message] = []
        self._next_keyframe = 0
        self.history = ErrorHistory(folder / 'error.csv')
        self.gaps: list[str] = []

    @property
    def scene(self) -> Scene:
        """The scene of the new run."""
        return self._other.cloth.scene

    def take(self, entry: Entry) -> None:
        """Simulate an entry of the timeline; raises ValueError for a damaged one."""
        if isinstance(entry, Start):
            self._start(entry)
        elif isinstance(entry, Step):
            self._step(entry)
        elif isinstance(entry, Gap):
            self.gaps.append(gap_text(entry))
        elif isinstance(entry, Message):
            self._copy(entry)

    def _copy(self, message: Message) -> None:
        """Copy an input; transforms that do not change are there before the cloth."""
        if message.topic.endswith('/wrench'):  # of the recorded run
            return
        if self._bag is not None:
            self._bag.copy(message)
        elif message.topic == '/tf_static':
            self._early.append(message)

    def _start(self, entry: Start) -> None:
        keyframe = entry.keyframe
        self._other.start(keyframe)
        if self._bag is None:
            self._bag = OutputBag(
                self._folder / 'bag',
                self._recorded.node,
                self.scene.frame_id,
                lambda: self._recorded.received,
            )
            for message in self._early:
                self._bag.copy(message)
        self._bag.write_scene(self.scene, keyframe.stamp)
        self._write_keyframe(self._bag, keyframe.tick, keyframe.stamp)

    def _step(self, entry: Step) -> None:
        record = entry.record
        self._other.repeat(record)
        reset = any(change.kind == RESET for change in record.changes)
        self.history.advance(record.seconds, reset=reset)
        if entry.recorded is not None:
            positions = entry.recorded[..., :3].astype(float)
            rows, columns, _ = positions.shape
            distance = np.linalg.norm(self._other.positions_on(rows, columns) - positions, axis=-1)
            self.history.add(record.stamp, self._other.cloth.time, distance)
            if self._bag is not None and self._settings.errors:
                values = np.concatenate([positions, distance[..., None]], axis=-1)
                self._bag.write_errors(record.stamp, values.astype(np.float32))
        if self._bag is not None:
            self._write_step(self._bag, entry)

    def _write_step(self, bag: OutputBag, entry: Step) -> None:
        record, sheet = entry.record, self.scene.sheet
        if any(change.kind == CONFIGURED for change in record.changes):
            bag.write_scene(self.scene, record.stamp)
        particles = np.empty((sheet.rows, sheet.columns, 6), np.float32)
        self._other.cloth.write_particles(particles)
        known = particles if self.scene.particles.velocities else particles[..., :3]
        bag.write_particles(record.stamp, known)
        bag.write_record(self._other.record(record))
        if record.tick >= self._next_keyframe:
            self._write_keyframe(bag, record.tick, record.stamp)

    def _write_keyframe(self, bag: OutputBag, tick: int, stamp: int) -> None:
        bag.write_keyframe(self._other.keyframe(tick, stamp))
        self._next_keyframe = tick + round(INTERVAL * self.scene.rate)

    def close(self) -> None:
        """Complete the files."""
        self.history.close()
        if self._bag is not None:
            self._bag.close()
