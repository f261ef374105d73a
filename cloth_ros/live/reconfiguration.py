"""
Change what a running cloth simulates: on request, or because of overload.

Either change may need kernels that must be compiled first.  Until they are there, the cloth
continues as it is.  A requested change replaces one because of overload.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import NamedTuple

from ..scene import Scene
from ..scene.parameter import format_error
from .coarse_cloth import simulated_scene
from .compile_kernels import kinds_of
from .kernel_compiler import KernelCompiler, Log
from .overload import Level, Overload

# Time to wait for kernels before the cloth continues without them, s: often they are in memory,
# and a tick that is late by so much loses no time.
_SHORT = 0.03


class Change(NamedTuple):
    """
    A change of what is simulated, and the kernels that it needs.

    Attributes
    ----------
    overload
        What is given up of the new scene.
    level
        What is to be simulated.
    requested
        True if it was requested; False if it is because of overload.
    kernels
        Done when the kernels are there, or cannot be made.

    """

    overload: Overload
    level: Level
    requested: bool
    kernels: list[Future[None]]

    @property
    def ready(self) -> bool:
        """True if no kernel is still being made."""
        return all(future.done() for future in self.kernels)

    @property
    def error(self) -> BaseException | None:
        """Why a kernel cannot be made."""
        return next((error for each in self.kernels if (error := each.exception())), None)


class Reconfiguration:
    """
    Decide when a cloth changes to another scene, tolerance or grid.

    Parameters
    ----------
    scene
        The scene that is simulated at first.
    compiler
        Makes the kernels.
    log
        Where to report what is delayed or fails.

    Attributes
    ----------
    requested
        The scene that was last requested.
    overload
        What is given up of the scene that is simulated.

    """

    def __init__(self, scene: Scene, compiler: KernelCompiler, log: Log) -> None:
        self.requested = scene
        self.overload = Overload(scene)
        self._compiler, self._log = compiler, log
        self._change: Change | None = None
        self._failed: Scene | None = None

    def check_no_request_of(self, name: str) -> None:
        """Raise ValueError if a collider or gripper was requested that is not there yet."""
        kinds = {'collider': self.requested.all_colliders(), 'gripper': self.requested.grippers}
        for kind, requested in kinds.items():
            if any(each.name == name for each in requested):
                raise ValueError(
                    f'the {kind} {name!r} is not there yet: its kernels are being compiled; '
                    'send the command again'
                )

    @property
    def reduction(self) -> str:
        """What is given up because of overload, in words; empty if nothing is."""
        return self.overload.level.text if self.overload.depth else ''

    @property
    def settled(self) -> bool:
        """True if what was last requested is simulated, and no other request is under way."""
        requesting = self._change is not None and self._change.requested
        return self.requested is self.overload.requested and not requesting

    @property
    def failed(self) -> bool:
        """True if the kernels of what was last requested cannot be compiled."""
        return self.requested is self._failed

    def relax(self, cost: float) -> None:
        """Give up accuracy if the machine is too slow; `cost` is that of a substep now, s."""
        self._change_level(self.overload.relax, cost)

    def recover(self, cost: float) -> None:
        """Take back the last reduction if the machine is fast enough for that."""
        self._change_level(self.overload.recover, cost)

    def _change_level(self, choose: Callable[[float], bool], cost: float) -> None:
        if self._change is None and choose(cost):
            self._prepare(self.overload)

    def _prepare(self, overload: Overload) -> bool:
        """Load or compile the kernels of a level; return whether they are there already."""
        level = overload.level
        scene = simulated_scene(level.scene, level.spacing)
        kernels = [
            self._compiler.compile(scene, (kind,), f'{kind} for changed parameters')
            for kind in kinds_of(scene)
        ]
        self._change = Change(overload, level, overload is not self.overload, kernels)
        wait(kernels, _SHORT)
        return self._change.ready

    def poll(self) -> Change | None:
        """Return a change to be made now: all its kernels are there."""
        self._start_requested()
        change = self._change
        if change is None or not change.ready:
            return None
        self._change = None
        error = change.error
        if error is None:
            self.overload = change.overload
            return change
        if change.requested:
            self._failed = change.overload.requested  # the same would fail at each tick
            self._log.error(
                f'the kernels for the changed parameters cannot be compiled '
                f'({format_error(error)}): the cloth keeps its former parameters, although the '
                'node reports the new ones; set any parameter to try again'
            )
        else:
            self._log.error(
                f'overload, {change.level.text}: the kernels cannot be compiled '
                f'({format_error(error)})'
            )
        return None

    def _start_requested(self) -> None:
        """Prepare the requested scene, unless another request is being prepared."""
        wanted = self.requested
        if wanted is self.overload.requested or wanted is self._failed:
            return
        if self._change is not None and self._change.requested:
            return
        if not self._prepare(Overload(wanted)):
            self._log.info(
                'compiling kernels for the changed parameters; the cloth keeps its former '
                'parameters until they are ready'
            )
