"""
Atomic operations on elements of an array of numpy.int64, for threads in compiled kernels.

Numba has them for GPUs only; these emit LLVM's instructions.
"""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import intrinsic

from .jit import Kernel


def _pointer(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    return builder.gep(array.data, [arguments[1]])


def _load(_: Any, array: Any, index: Any) -> Any:
    def generate(*given: Any) -> Any:
        return given[1].load_atomic(_pointer(*given), 'acquire', 8)

    return types.int64(array, types.int64), generate


def _fetch_add(_: Any, array: Any, index: Any) -> Any:
    def generate(*given: Any) -> Any:
        one = given[0].get_constant(types.int64, 1)
        return given[1].atomic_rmw('add', _pointer(*given), one, 'acq_rel')

    return types.int64(array, types.int64), generate


def _compare_exchange(_: Any, array: Any, index: Any, expected: Any, value: Any) -> Any:
    def generate(*given: Any) -> Any:
        _, builder, _, arguments = given
        pointer = _pointer(*given)
        found = builder.cmpxchg(pointer, arguments[2], arguments[3], 'acq_rel', 'acquire')
        return builder.extract_value(found, 0)

    return types.int64(array, types.int64, types.int64, types.int64), generate


# load(array, index): the element.
load: Kernel = intrinsic(_load)
# fetch_add(array, index): add 1; returns the old value.
fetch_add: Kernel = intrinsic(_fetch_add)
# compare_exchange(array, index, expected, value): write `value` where `expected` is; returns
# the old value.
compare_exchange: Kernel = intrinsic(_compare_exchange)
