"""Numba's on-disk cache of kernels: load from it without compiling, and whether it can be used."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core import event
from numba.core.caching import NullCache

from .triangles import _write_quads

# s, after which a thread hands the GIL to others that wait for it.  Loading and compiling need it
# for long; with the usual 5 ms, every tick meanwhile would be late by a multiple of that.
_SWITCH_INTERVAL = 2e-4
_USUAL_INTERVAL = sys.getswitchinterval()


class KernelNotCached(Exception):  # noqa: N818
    """A kernel is neither in memory nor in the cache, and must not be compiled here and now."""


class _CompileListener(event.Listener):
    """Raises `KernelNotCached` where Numba begins to compile in a thread that must not."""

    def __init__(self) -> None:
        self.thread = threading.local()

    def on_start(self, event: Any) -> None:
        """Stop the compilation that is about to begin."""
        if getattr(self.thread, 'forbidden', False):
            raise KernelNotCached(str(event.data['dispatcher']))

    def on_end(self, event: Any) -> None:
        """Do nothing."""


_listener = _CompileListener()
event.register('numba:compile', _listener)  # type: ignore[no-untyped-call]


@contextmanager
def cached_only() -> Iterator[None]:
    """Within this context, raise `KernelNotCached` where this thread would have to compile."""
    _listener.thread.forbidden = True
    try:
        yield
    finally:
        _listener.thread.forbidden = False


def cache_exists() -> bool:
    """Return False if there is no folder to keep compiled kernels in; see `kernels.jit`."""
    kernel: Any = _write_quads
    return not isinstance(kernel._cache, NullCache)


@contextmanager
def short_switch_interval() -> Iterator[None]:
    """Hand over the GIL more often within this context, so that other threads wait less."""
    sys.setswitchinterval(min(_SWITCH_INTERVAL, _USUAL_INTERVAL))
    try:
        yield
    finally:
        sys.setswitchinterval(_USUAL_INTERVAL)
