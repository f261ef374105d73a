"""Kernels compiled beside what goes on."""

from __future__ import annotations

import atexit
import sys
import threading
from collections.abc import Callable
from typing import Any, Generic, TypeVar
from weakref import WeakSet

import numpy as np

from ..model.cloth import Cloth
from ..model.resample import interpolate
from ..model.time_step import precision_for
from ..scene import Scene

T = TypeVar('T')

# s, after which a thread gives up Python's lock to others that want it.  While something is
# compiled it is wanted at every kernel, and the usual 5 ms would be felt in each tick.
_SWITCH = 2e-4
_USUAL = sys.getswitchinterval()


class Background(Generic[T]):
    """
    Something that is made in a thread.

    Parameters
    ----------
    make
        What makes it.

    Attributes
    ----------
    made
        It, once it is made; None before.
    error
        What was raised instead.

    """

    def __init__(self, make: Callable[[], T]) -> None:
        self.made: T | None = None
        self.error: BaseException | None = None
        self._make = make
        _all.add(self)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        sys.setswitchinterval(min(_SWITCH, _USUAL))
        try:
            self.made = self._make()
        except BaseException as error:  # handed on to whoever asks
            self.error = error
        finally:
            sys.setswitchinterval(_USUAL)

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until it is made, or for so many seconds; return whether it is done."""
        self._thread.join(seconds)
        return self.done

    @property
    def done(self) -> bool:
        """True if it is made, or will not be."""
        return not self._thread.is_alive()


_all: WeakSet[Background[Any]] = WeakSet()


@atexit.register
def _wait_for_all() -> None:
    """Wait at the end of the process: it would take what LLVM uses from under a thread in it."""
    for each in list(_all):
        each.wait()


def compile_for(scene: Scene, spacing: int = 1) -> None:
    """Compile the kernels of a scene, on a small piece of its sheet; see `cloth_on`."""
    if spacing > 1:
        interpolate(np.zeros((1, 1, 1, 3)), 1, 1)
    sheet = scene.sheet
    piece = {
        'sheet.rows': min(sheet.rows, 3),
        'sheet.columns': min(sheet.columns, 3),
        'solver.precision': precision_for(scene),
    }
    Cloth(scene.with_parameters({**piece, 'pins': [''], 'solver.substeps': 0})).compile()
