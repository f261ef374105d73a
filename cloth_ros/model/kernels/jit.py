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
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

# Reassociation lets sums vectorise; reciprocals and square roots may be estimated and refined.
# NaN and infinity keep their meaning ('nnan' and 'ninf' are left out), so that a state that is
# not finite shows as such.
RELAXED = {'reassoc', 'contract', 'arcp', 'afn', 'nsz'}

# Without wrappers for calls from C and from Python that are not needed: a third of the time.
_NO_CALLBACK: dict[str, Any] = {'no_cfunc_wrapper': True}
_NOT_FROM_PYTHON: dict[str, Any] = {'no_cfunc_wrapper': True, 'no_cpython_wrapper': True}

_NOT_KEPT = (
    'kernels are compiled again at each start, because neither the package nor HOME can be '
    'written; set NUMBA_CACHE_DIR'
)
_NO_ROOM = (
    'kernels are compiled again at each start, because the cache cannot be written: {}; '
    'free some space, or set NUMBA_CACHE_DIR'
)
_UNREADABLE = (
    'kernels are compiled again, because the cache in {} cannot be read: {}; remove it if this '
    'is repeated'
)

# Kernels are typed by Numba when they are compiled, not before.
Kernel = Callable[..., Any]


def _use_wide_vectors() -> None:
    """
    Compile loops to the widest vectors of the processor.

    LLVM uses 256 bits where the processor has 512, a third slower here, and leaves a loop scalar,
    ten times slower, if it would have to check at its start whether more than some 10 arrays
    overlap.  Processor features that the user has chosen for Numba are kept.
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
    """Warn once: Numba resets the registry of warnings at each compilation."""
    warnings.warn(text, stacklevel=1)


def _reason(error: Exception) -> str:
    """Return the reason of an error, without the file, which differs for each kernel."""
    return getattr(error, 'strerror', None) or type(error).__name__


@functools.cache
def _sources() -> str:
    """Return a hash of all sources of the model: a kernel is made of several of them."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parents[1].rglob('*.py')):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def _closure(function: Any) -> Any:
    """
    Return the values in the closure of a function, and in those of functions among them.

    Numba would take a function there by a number that differs in each process.
    """
    cells = [cell.cell_contents for cell in function.__closure__ or ()]
    functions = [getattr(value, 'py_func', None) for value in cells]
    return tuple(
        repr(value) if inner is None else (inner.__module__, inner.__qualname__, _closure(inner))
        for value, inner in zip(cells, functions, strict=True)
    )


class _Cache(FunctionCache):
    """Cache of the machine code of a kernel on disk, for the next start."""

    def __init__(self, function: Kernel) -> None:
        super().__init__(function)  # type: ignore[no-untyped-call]
        files: Any = self._cache_file
        # Numba checks the file of the kernel alone, not those of functions inlined into it.
        files._source_stamp = (files._source_stamp, _sources())
        # Numba writes the index before the code that it names, and numbers code from 1: after a
        # kill in between, or beside another process, a number may name other code.
        self._code = f'{files._index_name}.{{}}.nbc'
        files._data_name = lambda _: self._code.format(uuid.uuid4().hex)

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        """Return the key of a kernel: its types, the processor, and the values in its closure."""
        return (sig, codegen.magic_tuple(), _closure(self._py_func))

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the cached code, or None; code that cannot be read is compiled again."""
        try:
            return super().load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except Exception as error:  # from the system, from damaged bytes, from LLVM
            _warn(_UNREADABLE.format(self.cache_path, _reason(error)))
            with suppress(OSError):
                self.flush()  # type: ignore[no-untyped-call]
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Cache the code; a full disk is only a warning."""
        try:
            self._remove_outdated()
            super().save_overload(sig, data)  # type: ignore[no-untyped-call]
        except Exception as error:
            _warn(_NO_ROOM.format(_reason(error)))

    def _remove_outdated(self) -> None:
        files: Any = self._cache_file
        if not files._load_index():  # it belongs to an older source
            for path in Path(self.cache_path).glob(self._code.format('*')):
                path.unlink(missing_ok=True)


class _PartLibrary(JITCodeLibrary):
    """
    Code of a part of kernels, which is neither optimised nor made machine code.

    Numba links it into each kernel, and optimises that.  Only the environment of the part, a
    variable that Numba writes to, must have an address.
    """

    def _optimize_final_module(self) -> None:
        """Leave that to the kernels."""

    def _finalize_final_module(self) -> None:
        module: Any = self._final_module
        for function in module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.external:
                function.linkage = 'linkonce_odr'
        self._shared_module = module
        names = [each.name for each in module.global_variables if 'NumbaEnv' in each.name]
        # An integer in place of a pointer, whose syntax differs between versions of LLVM.
        self._final_module = llvm.parse_assembly(
            '\n'.join([f'@{name} = common global i64 0' for name in names])
        )
        super()._finalize_final_module()  # type: ignore[no-untyped-call]


class _PartCompiler(Compiler):
    """Compiles parts of kernels."""

    def define_pipelines(self) -> Any:
        state: Any = self.state
        name = state.func_id.func_qualname
        state.library = _PartLibrary(state.targetctx.codegen(), name)  # type: ignore[no-untyped-call]
        return super().define_pipelines()  # type: ignore[no-untyped-call]


class _DisjointPartCompiler(_PartCompiler):
    """Compiles parts of kernels whose arrays do not overlap."""

    def define_pipelines(self) -> Any:
        self.state.flags.noalias = True
        return super().define_pipelines()


def _part(function: Kernel, compiler: type[Compiler] = _PartCompiler, **options: Any) -> Kernel:
    """Compile a part of kernels, which is not cached on disk: the kernels are."""
    compiled: Kernel = numba.njit(
        error_model='numpy', pipeline_class=compiler, **_NOT_FROM_PYTHON, **options
    )(function)
    return compiled


def _compiled(function: Kernel, **options: Any) -> Kernel:
    """Compile with Numba, and cache the machine code where that is possible."""
    compiled: Any = numba.njit(error_model='numpy', **options)(function)
    try:
        compiled._cache = _Cache(function)
    except RuntimeError:  # Numba finds no folder for its cache
        _warn(_NOT_KEPT)
    return compiled  # type: ignore[no-any-return]


def kernel(function: Kernel) -> Kernel:
    """
    Compile a vectorising kernel.

    Loops index with `numpy.uint64`: for signed indices the compiler must allow for Python's
    negative ones, and the wrap-around keeps a loop scalar.
    """
    return _compiled(function, fastmath=RELAXED, nogil=True, **_NO_CALLBACK)


def inlined(function: Kernel) -> Kernel:
    """
    Compile a part of a kernel that is always inlined.

    A call that the compiler does not inline keeps the loop around it scalar.
    """
    return _part(function, fastmath=RELAXED, forceinline=True)


def disjoint(function: Kernel) -> Kernel:
    """
    Compile a part of a kernel that is always inlined, and whose arrays do not overlap.

    Nothing then checks before each loop that they do not, which for 15 arrays takes as long as
    their loop over some 100 particles.  Rows of one array must be passed each for itself.
    """
    return _part(function, _DisjointPartCompiler, fastmath=RELAXED, forceinline=True)


@inlined
def components(field):  # type: ignore[no-untyped-def]
    """Return x, y and z of a field as arrays of their own, as `disjoint` parts need them."""
    return field[0], field[1], field[2]


def exact(function: Kernel) -> Kernel:
    """Compile a kernel with IEEE arithmetic, where decisions depend on the last bits."""
    return _compiled(function, nogil=True, **_NO_CALLBACK)


def exact_subroutine(function: Kernel) -> Kernel:
    """Compile a function with IEEE arithmetic for kernels; a call from Python would crash."""
    return _part(function)


def exact_inlined(function: Kernel) -> Kernel:
    """
    Compile a part of a kernel with IEEE arithmetic that is always inlined.

    To pass arrays to a subroutine takes some 20 ns, longer than small ones run.
    """
    return _part(function, forceinline=True)


def reduction(function: Kernel) -> Kernel:
    """
    Compile a subroutine of minima and maxima.

    Without 'nnan' these stay scalar, because NaN would have to be propagated.
    """
    return _part(function, fastmath=True)
