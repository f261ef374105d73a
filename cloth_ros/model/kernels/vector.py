"""
Vectors of four numbers in registers of the processor, for compiled kernels.

For loops that gather rows of an array one by one, which do not vectorise: four rows of four
numbers are loaded and transposed, so that an instruction treats the same number of all of them.
Vectors are added, subtracted, multiplied and divided number by number, and multiplied by numbers
on their left.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model

from .jit import RELAXED, Kernel

# Numbers in a vector, and rows that are gathered.
SIZE = 4
_FLAGS = tuple(sorted(RELAXED))
_INDEX = ir.IntType(32)

# Lanes of two vectors, those of the second from SIZE on, in the steps of transposing four: one and
# one in turn, and two and two.
_LOW, _HIGH = (0, 4, 1, 5), (2, 6, 3, 7)
_FIRST, _SECOND = (0, 1, 4, 5), (2, 3, 6, 7)

_Generator = Callable[..., Any]

# Functions of Numba that have no types.
_tuple: Callable[..., Any] = cgutils.unpack_tuple
_function: Callable[..., Any] = cgutils.get_or_insert_function


class _Vector(types.Type):
    """Numba's type of a vector, by the type of its numbers."""

    def __init__(self, element: Any) -> None:
        self.element = element
        super().__init__(f'vector of {SIZE} {element}')


@register_model(_Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, of: _Vector) -> None:
        number = ir.FloatType() if of.element == types.float32 else ir.DoubleType()
        super().__init__(manager, of, ir.VectorType(number, SIZE))  # type: ignore[no-untyped-call]


def _shuffled(builder: Any, first: Any, second: Any, lanes: Any) -> Any:
    """Return a vector of numbers of two others."""
    mask = ir.Constant(ir.VectorType(_INDEX, len(lanes)), lanes)
    return builder.shuffle_vector(first, second, mask)


def _filled(builder: Any, number: Any) -> Any:
    """Return a vector of the same numbers."""
    empty = ir.Constant(ir.VectorType(number.type, SIZE), ir.Undefined)
    first = builder.insert_element(empty, number, _INDEX(0))
    return _shuffled(builder, first, empty, (0,) * SIZE)


def _transposed(builder: Any, vectors: Any) -> list[Any]:
    """Return vectors of the first numbers of four vectors, of the second ones, and so on."""
    a, b, c, d = vectors
    halves = [
        [_shuffled(builder, first, second, lanes) for first, second in ((a, b), (c, d))]
        for lanes in (_LOW, _HIGH)
    ]
    return [
        _shuffled(builder, first, second, lanes)
        for first, second in halves
        for lanes in (_FIRST, _SECOND)
    ]


def _address(context: Any, builder: Any, array: Any, value: Any, index: Any) -> Any:
    """Return the address of numbers of a C-contiguous array, from one of all of them on."""
    data = context.make_array(array)(context, builder, value).data
    vector = ir.VectorType(data.type.pointee, SIZE)
    return builder.bitcast(builder.gep(data, [index]), vector.as_pointer())


def _alignment(array: Any) -> int:
    return int(array.dtype.bitwidth) // 8


def _load(_: Any, array: Any, index: Any) -> tuple[Any, _Generator]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        address = _address(context, builder, array, *arguments)
        return builder.load(address, align=_alignment(array))

    return _Vector(array.dtype)(array, index), generate


def _row_addresses(context: Any, builder: Any, signature: Any, arguments: Any) -> list[Any]:
    """Return where rows are, for arguments that begin with array, indices, n."""
    array, _, n = signature.args[:3]
    offset = ir.Constant(ir.IntType(64), SIZE * n.literal_value)
    return [
        _address(context, builder, array, arguments[0], builder.add(index, offset))
        for index in _tuple(builder, arguments[1])
    ]


def _gather(_: Any, array: Any, indices: Any, n: Any) -> tuple[Any, _Generator]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        rows = [
            builder.load(address, align=_alignment(array))
            for address in _row_addresses(context, builder, signature, arguments)
        ]
        return context.make_tuple(builder, signature.return_type, _transposed(builder, rows))

    result: Any = types.UniTuple(_Vector(array.dtype), SIZE)  # type: ignore[no-untyped-call]
    return result(array, indices, n), generate


def _scatter(_: Any, array: Any, indices: Any, n: Any, vectors: Any) -> tuple[Any, _Generator]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        rows = _transposed(builder, _tuple(builder, arguments[3]))
        addresses = _row_addresses(context, builder, signature, arguments)
        for row, address in zip(rows, addresses, strict=True):
            builder.store(row, address, align=_alignment(array))
        return context.get_dummy_value()

    return types.void(array, indices, n, vectors), generate


def _filled_with(_: Any, number: Any) -> tuple[Any, _Generator]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _filled(builder, arguments[0])

    return _Vector(number)(number), generate


def _chosen(comparison: str) -> Callable[..., tuple[Any, _Generator]]:
    """
    Return what makes the code of a function of two vectors.

    It returns the numbers of the first where they compare so with those of the second, else these.
    """

    def choose(_: Any, first: Any, second: Any) -> tuple[Any, _Generator]:
        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            return builder.select(builder.fcmp_ordered(comparison, *arguments), *arguments)

        return first(first, second), generate

    return choose


def _where_positive(_: Any, first: Any, second: Any) -> tuple[Any, _Generator]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        first, second = arguments
        zero = ir.Constant(second.type, [0.0] * SIZE)
        return builder.select(builder.fcmp_ordered('>', first, zero), second, zero)

    return second(first, second), generate


def _root(_: Any, vector: Any) -> tuple[Any, _Generator]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kind = arguments[0].type
        name = f'llvm.sqrt.v{SIZE}{kind.element.intrinsic_name}'
        function = ir.FunctionType(kind, [kind])
        root = _function(builder.module, function, name)
        return builder.call(root, arguments, fastmath=_FLAGS)

    return vector(vector), generate


def _add(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.fadd(*arguments, flags=_FLAGS)


def _subtract(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.fsub(*arguments, flags=_FLAGS)


def _multiply(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.fmul(*arguments, flags=_FLAGS)


def _divide(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.fdiv(*arguments, flags=_FLAGS)


def _scale(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.fmul(_filled(builder, arguments[0]), arguments[1], flags=_FLAGS)


def _define(function: Any, left: type[types.Type], generate: _Generator) -> None:
    """
    Define an operator on a vector at its right; the result is a vector like this.

    As an instruction: a function that overloads the operator would be compiled for itself.
    """

    class Operator(AbstractTemplate):
        def generic(self, arguments: Any, _: Any) -> Any:
            first, second = arguments
            if not (isinstance(first, left) and isinstance(second, _Vector)):
                return None
            if first not in (second, second.element):
                return None
            return signature(second, first, second)  # type: ignore[no-untyped-call]

    infer_global(function)(Operator)  # type: ignore[no-untyped-call]
    lower_builtin(function, left, _Vector)(generate)  # type: ignore[no-untyped-call]


_define(operator.add, _Vector, _add)
_define(operator.sub, _Vector, _subtract)
_define(operator.mul, _Vector, _multiply)
_define(operator.mul, types.Float, _scale)
_define(operator.truediv, _Vector, _divide)

# In what follows, arrays are C-contiguous, an index is one of all numbers of an array, and n is a
# constant.

# load(array, index): the numbers from an index on.
load: Kernel = intrinsic(_load)
# gather(array, indices, n): of rows that begin at four indices, the numbers 4 n to 4 n + 3; the
# first ones as a vector, the second ones, and so on.
gather: Kernel = intrinsic(prefer_literal=True)(_gather)
# scatter(array, indices, n, vectors): write what `gather` returns.
scatter: Kernel = intrinsic(prefer_literal=True)(_scatter)
# filled(x): x in all lanes.
filled: Kernel = intrinsic(_filled_with)
# least(a, b), greatest(a, b): number by number; those of b where one of both is not a number.
least: Kernel = intrinsic(_chosen('<'))
greatest: Kernel = intrinsic(_chosen('>'))
# where_positive(a, b): the numbers of b where those of a are positive, else 0.
where_positive: Kernel = intrinsic(_where_positive)
# root(a): the square roots.
root: Kernel = intrinsic(_root)
