"""
Vectors of four numbers in a register of the processor, for compiled kernels.

For loops that gather particles one by one, which do not vectorise: one instruction treats the
components of a position, and a fourth number, which is 0 there.  Vectors are added, subtracted,
and multiplied by numbers on their left.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model

from .jit import RELAXED, Kernel

_SIZE = 4
_FLAGS = tuple(sorted(RELAXED))
_INDEX = ir.IntType(32)

_Generator = Callable[..., Any]


class _Vector(types.Type):
    """Numba's type of a vector, by the type of its numbers."""

    def __init__(self, element: Any) -> None:
        self.element = element
        super().__init__(f'vector of four {element}')


@register_model(_Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, of: _Vector) -> None:
        number = ir.FloatType() if of.element == types.float32 else ir.DoubleType()
        super().__init__(manager, of, ir.VectorType(number, _SIZE))  # type: ignore[no-untyped-call]


def _shuffle(builder: Any, vector: Any, *lanes: int) -> Any:
    mask = ir.Constant(ir.VectorType(_INDEX, _SIZE), lanes)
    return builder.shuffle_vector(vector, ir.Constant(vector.type, ir.Undefined), mask)


def _filled(builder: Any, number: Any) -> Any:
    """Return a vector of one number, four times."""
    empty = ir.Constant(ir.VectorType(number.type, _SIZE), ir.Undefined)
    return _shuffle(builder, builder.insert_element(empty, number, _INDEX(0)), 0, 0, 0, 0)


def _pointer(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Return the address of a vector, for arguments that begin with array, row, n."""
    array = context.make_array(signature.args[0])(context, builder, arguments[0])
    row = builder.mul(arguments[1], builder.extract_value(array.strides, 0))
    address = builder.gep(builder.bitcast(array.data, ir.IntType(8).as_pointer()), [row])
    number = array.data.type.pointee
    vectors = builder.bitcast(address, ir.VectorType(number, _SIZE).as_pointer())
    return builder.gep(vectors, [ir.Constant(_INDEX, signature.args[2].literal_value)])


def _alignment(array: Any) -> int:
    return int(array.dtype.bitwidth) // 8


def _load(_: Any, array: Any, row: Any, n: Any) -> tuple[Any, _Generator]:
    def generate(*given: Any) -> Any:
        return given[1].load(_pointer(*given), align=_alignment(array))

    return _Vector(array.dtype)(array, row, n), generate


def _store(_: Any, array: Any, row: Any, n: Any, vector: Any) -> tuple[Any, _Generator]:
    def generate(*given: Any) -> Any:
        given[1].store(given[3][3], _pointer(*given), align=_alignment(array))
        return given[0].get_dummy_value()

    return types.void(array, row, n, vector), generate


def _vector3(_: Any, x: Any, y: Any, z: Any) -> tuple[Any, _Generator]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        vector = ir.Constant(ir.VectorType(arguments[0].type, _SIZE), [0.0] * _SIZE)
        for lane, number in enumerate(arguments):
            vector = builder.insert_element(vector, number, _INDEX(lane))
        return vector

    return _Vector(x)(x, y, z), generate


def _number(_: Any, vector: Any, n: Any) -> tuple[Any, _Generator]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.extract_element(arguments[0], _INDEX(n.literal_value))

    return vector.element(vector, n), generate


def _dot(_: Any, first: Any, second: Any) -> tuple[Any, _Generator]:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        products = builder.fmul(*arguments, flags=_FLAGS)
        for lanes in ((2, 3, 0, 1), (1, 0, 3, 2)):
            products = builder.fadd(products, _shuffle(builder, products, *lanes), flags=_FLAGS)
        return builder.extract_element(products, _INDEX(0))

    return first.element(first, second), generate


def _add(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.fadd(*arguments, flags=_FLAGS)


def _subtract(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return builder.fsub(*arguments, flags=_FLAGS)


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
_define(operator.mul, types.Float, _scale)

# load(array, row, n): numbers 4 n to 4 n + 3 of a row of a C-contiguous array, n a constant.
load: Kernel = intrinsic(prefer_literal=True)(_load)
# store(array, row, n, vector): write them.
store: Kernel = intrinsic(prefer_literal=True)(_store)
# vector3(x, y, z): these and 0.
vector3: Kernel = intrinsic(_vector3)
# number(vector, n): one of its numbers, n a constant.
number: Kernel = intrinsic(prefer_literal=True)(_number)
# dot(a, b): the sum of the products.
dot: Kernel = intrinsic(_dot)
