"""
Start of a cloth: load its kernels from the cache on disk, and compile those that it lacks.

Missing kernels of motion and of contact are compiled at once, in two child processes.  The cloth
is held in its initial state until those of motion are there.  Without those of contact it moves as
long as no collider can reach it; then it is held too.  A held cloth is published but not
simulated, and no time is made up afterwards.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, wait

from ..model import Cloth
from ..scene import Scene
from ..scene.parameter import format_error
from .coarse_cloth import CoarseCloth
from .compile_kernels import kinds_of
from .kernel_cache import KernelNotCached, cached_only
from .kernel_compiler import NICE, KernelCompiler, Log

_POLL = 0.1  # s


class FirstStart:
    """
    Load the kernels of the first scene, or compile them in the background.

    Parameters
    ----------
    scene
        The scene.
    compiler
        Makes the kernels.
    log
        Where to report that the cloth is held.

    Attributes
    ----------
    missing
        Kinds of kernels that are not there yet.
    held
        Why the cloth is held; empty if it is not.

    """

    def __init__(self, scene: Scene, compiler: KernelCompiler, log: Log) -> None:
        self._scene, self._log = scene, log
        self.held = ''
        self._near = False
        self.missing: dict[str, Future[None]] = {}
        self._kinds = kinds_of(scene)
        self._numbered = True
        for kind in self._kinds:
            if not compiler.load(scene, (kind,)):
                # Nothing else is to be done before the kernels of motion are there.
                nice = 0 if kind == 'motion' else NICE
                self.missing[kind] = compiler.compile(scene, (kind,), self.label(kind), nice)

    def label(self, kind: str) -> str:
        """Return the name of a kind of kernels in log messages, such as 'contact (2 of 3)'."""
        if not self._numbered:
            return kind
        kinds = [*self._kinds, 'the error estimate']
        return f'{kind} ({kinds.index(kind) + 1} of {len(kinds)})'

    def initial_cloth(self) -> CoarseCloth:
        """
        Return the cloth in its initial state.

        If a collider overlaps with that, this waits for the kernels of contact.
        """
        try:
            with cached_only():
                return CoarseCloth(self._scene)
        except KernelNotCached:
            while wait(self.missing.values(), _POLL).not_done:  # a signal may raise in between
                pass
        self.poll()
        return CoarseCloth(self._scene)

    def poll(self) -> None:
        """Check which kernels have become available since the last call."""
        for kind, future in list(self.missing.items()):
            if future.done() and future.exception() is None:
                del self.missing[kind]
        if not self.missing:
            self.release()

    def abandon(self) -> None:
        """Wait no longer: another scene is simulated, whose kernels are all there."""
        self.missing.clear()
        self._numbered = False
        self.release()

    def advance(self, cloth: Cloth, seconds: float) -> Iterator[None]:
        """
        Advance as `Cloth.advance_stepwise`, unless kernels are missing: the cloth is then `held`.

        Once held for contact, it is held until the kernels are there: what is commanded meanwhile
        may have to pass the cloth.
        """
        if not self.missing:
            yield from cloth.advance_stepwise(seconds)
            return
        if 'motion' in self.missing:
            self._hold(self._describe('motion'))
            return
        contact = f'a collider may touch it, and {self._describe("contact")}'
        self._near = self._near or cloth.contact_possible(seconds)
        if self._near:
            self._hold(contact)
            return
        self.release()
        before = cloth.snapshot()
        try:
            with cached_only():
                yield from cloth.advance_stepwise(seconds)
        except KernelNotCached:  # a collider came nearer than was predicted
            cloth.restore(before)
            self._near = True
            self._hold(contact)

    def _hold(self, reason: str) -> None:
        if reason != self.held:
            self._log.info(f'the cloth is held: {reason}')
        self.held = reason

    def release(self) -> None:
        """Stop holding the cloth, until `advance` holds it again."""
        if self.held:
            self._log.info('the cloth is no longer held')
        self.held, self._near = '', False

    def _describe(self, kind: str) -> str:
        future = self.missing[kind]
        error = future.exception() if future.done() else None
        if error is None:
            return f'the kernels of {kind} are being compiled'
        return f'the kernels of {kind} cannot be compiled ({format_error(error)})'
