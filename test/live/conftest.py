"""A log that records, and a stub of the compiler of kernels."""

from __future__ import annotations

from collections.abc import Collection
from concurrent.futures import Future
from contextlib import suppress

import pytest

from cloth_ros import Scene
from cloth_ros.live import live_cloth
from cloth_ros.live.compile_kernels import warm_up


class RecordingLog:
    """Attribute `text` holds all that was logged, a line each."""

    def __init__(self) -> None:
        self.text = ''

    def info(self, message: str) -> None:
        self.text += message + '\n'

    warning = error = info


class StubCompiler:
    """
    A compiler that makes kernels when the test says so; background work is done at once.

    `missing` are the kinds of kernels that are not in the cache, `futures` those in progress.
    """

    def __init__(self, *missing: str) -> None:
        self.missing = set(missing)
        self.futures: list[Future[None]] = []
        self.closed = False

    def load(self, scene: Scene, kinds: Collection[str]) -> bool:
        warm_up(scene, kinds)
        return not self.missing.intersection(kinds)

    def compile(self, scene, kinds, label, nice=10) -> Future[None]:
        future: Future[None] = Future()
        if self.load(scene, kinds):
            future.set_result(None)
        else:
            self.futures.append(future)
        return future

    def ensure(self, scene, kinds, label, nice=10) -> None:
        warm_up(scene, kinds)

    def submit(self, function):
        future: Future = Future()
        try:
            future.set_result(function())
        except Exception as error:
            future.set_exception(error)
        return future

    def finish(self, error: Exception | None = None) -> None:
        """Complete all that is in progress."""
        futures, self.futures, self.missing = self.futures, [], set()
        for future in futures:
            with suppress(IndexError):
                future.set_exception(error) if error else future.set_result(None)

    def close(self) -> None:
        self.closed = True


@pytest.fixture
def log() -> RecordingLog:
    return RecordingLog()


@pytest.fixture
def compiler(monkeypatch: pytest.MonkeyPatch) -> StubCompiler:
    """The compiler of the next `LiveCloth`."""
    stub = StubCompiler()
    monkeypatch.setattr(live_cloth, 'KernelCompiler', lambda log: stub)
    return stub
