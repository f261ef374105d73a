"""Compilation of kernels by Numba: options, and the cache on disk."""

from __future__ import annotations

import functools
import hashlib
import uuid
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numba
from numba.core import config
from numba.core.caching import FunctionCache

# Reassociation lets sums vectorise; reciprocals and square roots may be estimated and refined.
# NaN and infinity keep their meaning ('nnan' and 'ninf' are left out), so that a state that is
# not finite shows as such.
_RELAXED = {'reassoc', 'contract', 'arcp', 'afn', 'nsz'}

# Wrappers for calls from C and from Python that nobody makes: a third of the compilation time.
_NO_CALLBACK: dict[str, Any] = {'no_cfunc_wrapper': True}
_NOT_FROM_PYTHON: dict[str, Any] = {'no_cfunc_wrapper': True, 'no_cpython_wrapper': True}

_NOT_KEPT = (
    'kernels are compiled anew at each start, for neither the package nor HOME can be written; '
    'set NUMBA_CACHE_DIR'
)
_NO_ROOM = (
    'kernels are compiled anew at each start, for they cannot be written where they are kept: {}; '
    'make room, or set NUMBA_CACHE_DIR'
)
_UNREADABLE = (
    'kernels are compiled anew, for what is kept of them in {} cannot be read: {}; remove it if '
    'this comes again'
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


def _reason(error: Exception) -> str:
    """Return what went wrong, without the file, which is another one for each kernel."""
    return getattr(error, 'strerror', None) or type(error).__name__


@functools.cache
def _sources() -> str:
    """Return what stands for all sources of the model: a kernel is made of several."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parents[1].rglob('*.py')):
        digest.update(path.read_bytes())
    return digest.hexdigest()


class _Cache(FunctionCache):
    """Where the machine code of a kernel is kept for the next start, as far as it can be."""

    def __init__(self, function: Kernel) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        files: Any = self._cache_file
        # Numba looks at the file of the kernel alone, not at what is inlined into it.
        files._source_stamp = (files._source_stamp, _sources())
        # It writes the index before the code it names, and numbers code from 1: after a kill in
        # between, or beside another process, a number may be that of other code.
        self._code = f'{files._index_name}.{{}}.nbc'
        files._data_name = lambda _: self._code.format(uuid.uuid4().hex)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return what was kept, or None; what cannot be read is compiled anew."""
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception as error:  # of the system, of the bytes, of LLVM
            _warn(_UNREADABLE.format(self.cache_path, _reason(error)))
            with suppress(OSError):
                self.flush()  # type: ignore[no-untyped-call]
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep what was compiled; a full disk is no end."""
        try:
            self._remove_outdated()
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except Exception as error:
            _warn(_NO_ROOM.format(_reason(error)))

    def _remove_outdated(self) -> None:
        files: Any = self._cache_file
        if not files._load_index():  # it is that of an older source
            for path in Path(self.cache_path).glob(self._code.format('*')):
                path.unlink(missing_ok=True)


def _compiled(function: Kernel, **options: Any) -> Kernel:
    """Compile with Numba, and keep what was compiled for the next start where that can be."""
    compiled: Any = numba.njit(error_model='numpy', **options)(function)
    try:
        compiled._cache = _Cache(function)
    except RuntimeError:  # of Numba, which finds no place for its cache
        _warn(_NOT_KEPT)
    return compiled  # type: ignore[no-any-return]


def kernel(function: Kernel) -> Kernel:
    """
    Compile a vectorising kernel.

    Loops index with `numpy.uint64`: for signed indices the compiler must allow for Python's
    negative ones, and the wrap-around keeps a loop scalar.
    """
    return _compiled(function, fastmath=_RELAXED, nogil=True, **_NO_CALLBACK)


def inlined(function: Kernel) -> Kernel:
    """
    Compile a part of a kernel that is always inlined.

    A call that the compiler does not inline keeps the loop around it scalar.
    """
    return _compiled(function, fastmath=_RELAXED, forceinline=True, **_NOT_FROM_PYTHON)


def exact(function: Kernel) -> Kernel:
    """Compile a kernel with IEEE arithmetic, where decisions depend on the last bits."""
    return _compiled(function, nogil=True, **_NO_CALLBACK)


def exact_subroutine(function: Kernel) -> Kernel:
    """Compile a function with IEEE arithmetic that only kernels call."""
    return _compiled(function, **_NOT_FROM_PYTHON)


def reduction(function: Kernel) -> Kernel:
    """
    Compile a subroutine of minima and maxima.

    Without 'nnan' these stay scalar, because NaN would have to be propagated.
    """
    return _compiled(function, fastmath=True, **_NOT_FROM_PYTHON)
