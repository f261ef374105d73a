"""How kernels are compiled: one place for the options that all of them share."""

from __future__ import annotations

import functools
import os
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import llvmlite.binding as llvm
import numba
from numba.core import config
from numba.core.caching import FunctionCache

# Reassociation lets sums vectorise; reciprocals and square roots may be estimated and refined.
# NaN and infinity keep their meaning ('nnan' and 'ninf' are left out), so that a state that is
# not finite shows as such.
_RELAXED = {'reassoc', 'contract', 'arcp', 'afn', 'nsz'}

_NOT_KEPT = (
    'kernels are compiled anew at each start, for neither the package nor HOME can be written; '
    'set NUMBA_CACHE_DIR'
)
_NO_ROOM = (
    'kernels are compiled anew at each start, for they cannot be written where they are kept: {}; '
    'make room, or set NUMBA_CACHE_DIR'
)

# Kernels are typed by Numba when they are compiled, not before.
Kernel = Callable[..., Any]


def _use_wide_vectors() -> None:
    """
    Have loops compiled to the widest vectors of the processor.

    LLVM takes 256 bits where the processor has 512, a third slower here, and leaves a loop scalar
    that would have to check at its start whether more than some 10 arrays overlap, ten times
    slower.  Who has chosen processor features for Numba is left alone.
    """
    llvm.set_option('', '--vectorize-memory-check-threshold=100000')
    chosen: Any = config
    features = llvm.get_host_cpu_features()
    if chosen.CPU_NAME is None and chosen.CPU_FEATURES is None and features.get('avx512f'):
        chosen.CPU_NAME = llvm.get_host_cpu_name()
        chosen.CPU_FEATURES = f'{features.flatten()},-prefer-256-bit'


_use_wide_vectors()


@functools.cache
def _warn(text: str) -> None:
    """Warn once: Numba has Python forget, at each compilation, what it has warned of."""
    warnings.warn(text, stacklevel=1)


class _Cache(FunctionCache):
    """Where the machine code of a kernel is kept for the next start, if there is room."""

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled; a full disk is no end."""
        try:
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except OSError as error:
            _warn(_NO_ROOM.format(error.strerror))
            with suppress(OSError):
                self._remove(sig, data)

    def _remove(self, sig: Any, data: Any) -> None:
        # The index is written first, and what it now names may be the code of an older source.
        files: Any = self._cache_file
        key = self._index_key(sig, data.codegen)  # type: ignore[no-untyped-call]
        name = files._load_index().get(key)
        if name is not None:
            os.unlink(files._data_path(name))


def _compiled(function: Kernel, **options: Any) -> Kernel:
    """Compile with Numba, and keep what was compiled for the next start where that can be."""
    compiled: Any = numba.njit(error_model='numpy', **options)(function)
    try:
        compiled._cache = _Cache(function)  # type: ignore[no-untyped-call]
    except RuntimeError:  # of Numba, which finds no place for its cache
        _warn(_NOT_KEPT)
    return compiled  # type: ignore[no-any-return]


def kernel(function: Kernel) -> Kernel:
    """
    Compile a vectorising kernel.

    Loops index with `numpy.uint64`: for signed indices the compiler must allow for Python's
    negative ones, and the wrap-around keeps a loop scalar.
    """
    return _compiled(function, fastmath=_RELAXED, nogil=True)


def inlined(function: Kernel) -> Kernel:
    """
    Compile a part of a kernel that is always inlined.

    A call that the compiler decides to leave standing keeps the loop around it scalar.
    """
    return _compiled(function, fastmath=_RELAXED, forceinline=True)


def exact(function: Kernel) -> Kernel:
    """Compile a kernel with IEEE arithmetic, where decisions hang on the last bits."""
    return _compiled(function, nogil=True)


def reduction(function: Kernel) -> Kernel:
    """
    Compile a kernel of least and greatest values.

    Without 'nnan' these stay scalar, for NaN would have to be carried along.
    """
    return _compiled(function, fastmath=True, nogil=True)
