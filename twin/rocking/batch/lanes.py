"""Sixteen numbers as one: the vector type in which the batch kernel steps sixteen cells together.

Numba leaves the vectors to LLVM's guess; here each operation on `Lanes` is emitted as one on <16 x double>, which
becomes two AVX-512 instructions, four of AVX or eight of SSE and NEON: enough to hide what each waits for. Lanes never
mix, so a cell's numbers do not depend on its neighbours. Multiply-add is fused where the processor can, everywhere
alike.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from importlib import import_module
from typing import Any

import llvmlite.ir  # pyright: ignore[reportMissingTypeStubs]
import numba.core.datamodel.models
import numba.core.types  # pyright: ignore[reportMissingTypeStubs]
import numba.extending  # pyright: ignore[reportMissingTypeStubs]

# The compiler's own interface has no types: it is named here, once.
ir: Any = llvmlite.ir
types: Any = numba.core.types
cgutils: Any = import_module("numba.core.cgutils")
extending: Any = numba.extending
intrinsic: Callable[[Callable[..., Any]], Any] = extending.intrinsic

Operation = Callable[[Any, Any], Any]

WIDTH = 16
_DOUBLES: Any = ir.VectorType(ir.DoubleType(), WIDTH)
_INTEGERS: Any = ir.VectorType(ir.IntType(64), WIDTH)


class LanesType(numba.core.types.Type):
    """Numba's type of sixteen doubles."""

    def __init__(self) -> None:
        super().__init__(name=f"Lanes{WIDTH}")


LANES: Any = LanesType()


class LanesModel(numba.core.datamodel.models.PrimitiveModel):
    """Held as one LLVM vector."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _DOUBLES)


extending.register_model(LanesType)(LanesModel)


def _all(number_type: Any, value: Any) -> Any:
    return ir.Constant(number_type, [value] * WIDTH)


def _row(context: Any, builder: Any, array_type: Any, array: Any, row: Any) -> Any:
    """Return a vector pointer to a row of a C-contiguous (n, WIDTH) array of doubles."""
    data = context.make_array(array_type)(context, builder, array).data
    place = builder.gep(data, [builder.mul(row, ir.Constant(row.type, WIDTH))])
    return builder.bitcast(place, _DOUBLES.as_pointer())


@intrinsic
def load(typing: Any, array: Any, row: Any) -> Any:  # noqa: ARG001 - numba's calling form
    """Return row `row` of an (n, WIDTH) array."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _row(context, builder, signature.args[0], values[0], values[1])
        return builder.load(place, align=8)

    return LANES(array, types.intp), emit


@intrinsic
def store(typing: Any, array: Any, row: Any, value: Any) -> Any:  # noqa: ARG001
    """Write row `row` of an (n, WIDTH) array."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        place = _row(context, builder, signature.args[0], values[0], values[1])
        builder.store(values[2], place, align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, LANES), emit


@intrinsic
def spread(typing: Any, number: Any) -> Any:  # noqa: ARG001
    """Return the same number in every lane."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:  # noqa: ARG001
        lanes: Any = ir.Constant(_DOUBLES, ir.Undefined)
        lanes = builder.insert_element(lanes, values[0], ir.Constant(ir.IntType(32), 0))
        return builder.shuffle_vector(
            lanes, ir.Constant(_DOUBLES, ir.Undefined), ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
        )

    return LANES(types.float64), emit


def _binary(emit_one: Callable[[Any, Any, Any], Any]) -> Any:
    @intrinsic
    def operation(typing: Any, left: Any, right: Any) -> Any:  # noqa: ARG001
        def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:  # noqa: ARG001
            return emit_one(builder, values[0], values[1])

        return LANES(LANES, LANES), emit

    return operation


_add = _binary(lambda builder, x, y: builder.fadd(x, y))
_sub = _binary(lambda builder, x, y: builder.fsub(x, y))
_mul = _binary(lambda builder, x, y: builder.fmul(x, y))
_div = _binary(lambda builder, x, y: builder.fdiv(x, y))
smaller = _binary(lambda builder, x, y: builder.select(builder.fcmp_ordered("<", x, y), x, y))
larger = _binary(lambda builder, x, y: builder.select(builder.fcmp_ordered(">", x, y), x, y))
# 1 where the comparison holds, else 0; not a number counts as below everything.
above = _binary(
    lambda builder, x, y: builder.select(builder.fcmp_ordered(">", x, y), _all(_DOUBLES, 1.0), _all(_DOUBLES, 0.0))
)


def _overload(symbol: Any, operation: Any) -> None:
    def for_lanes(x: Any, y: Any) -> Any:
        lanes: Operation | None = None
        if isinstance(x, LanesType) and isinstance(y, LanesType):
            lanes = lambda x, y: operation(x, y)  # noqa: E731 - numba compares the parameters' names
        elif isinstance(x, LanesType) and isinstance(y, types.Float):
            lanes = lambda x, y: operation(x, spread(y))  # noqa: E731
        elif isinstance(x, types.Float) and isinstance(y, LanesType):
            lanes = lambda x, y: operation(spread(x), y)  # noqa: E731
        return lanes

    for_lanes.__annotations__.clear()  # numba compares the parameters with the lambdas', which cannot have any
    extending.overload(symbol)(for_lanes)


_overload(operator.add, _add)
_overload(operator.sub, _sub)
_overload(operator.mul, _mul)
_overload(operator.truediv, _div)  # pyright: ignore[reportUnknownMemberType]


@intrinsic
def multiply_add(typing: Any, x: Any, y: Any, z: Any) -> Any:  # noqa: ARG001
    """Return x y + z, fused where the processor can."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:  # noqa: ARG001
        kind = ir.FunctionType(_DOUBLES, [_DOUBLES] * 3)
        name = f"llvm.fmuladd.v{WIDTH}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), values)

    return LANES(LANES, LANES, LANES), emit


@intrinsic
def magnitude(typing: Any, x: Any) -> Any:  # noqa: ARG001
    """Return |x|."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:  # noqa: ARG001
        bits = builder.and_(builder.bitcast(values[0], _INTEGERS), _all(_INTEGERS, 0x7FFFFFFFFFFFFFFF))
        return builder.bitcast(bits, _DOUBLES)

    return LANES(LANES), emit


@intrinsic
def chosen(typing: Any, mask: Any, x: Any, y: Any) -> Any:  # noqa: ARG001
    """Return x where the mask is above 0, else y, whatever the other is."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:  # noqa: ARG001
        holds = builder.fcmp_ordered(">", values[0], _all(_DOUBLES, 0.0))
        return builder.select(holds, values[1], values[2])

    return LANES(LANES, LANES, LANES), emit


@intrinsic
def marked(typing: Any, mask: Any) -> Any:  # noqa: ARG001
    """Return an integer whose n-th bit tells whether the mask is above 0 in lane n."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:  # noqa: ARG001
        holds = builder.fcmp_ordered(">", values[0], _all(_DOUBLES, 0.0))
        bits = builder.bitcast(holds, ir.IntType(WIDTH))
        return builder.zext(bits, ir.IntType(64))

    return types.int64(LANES), emit


@intrinsic
def turned(typing: Any, shifted: Any, sine: Any, cosine: Any) -> Any:  # noqa: ARG001
    """Return sine and cosine of an angle n quarter turns on; `shifted` carries n in its lowest bits."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        n = builder.bitcast(values[0], _INTEGERS)
        one, two, top = _all(_INTEGERS, 1), _all(_INTEGERS, 2), _all(_INTEGERS, 62)
        odd = builder.icmp_unsigned("==", builder.and_(n, one), one)
        swapped = builder.select(odd, values[2], values[1]), builder.select(odd, values[1], values[2])
        flips = builder.and_(n, two), builder.and_(builder.add(n, one), two)
        signed = [
            builder.bitcast(builder.xor(builder.bitcast(x, _INTEGERS), builder.shl(flip, top)), _DOUBLES)
            for x, flip in zip(swapped, flips, strict=True)
        ]
        return context.make_tuple(builder, signature.return_type, signed)

    return types.UniTuple(LANES, 2)(LANES, LANES, LANES), emit


@intrinsic
def rough_root(typing: Any, x: Any, share: Any) -> Any:  # noqa: ARG001
    """Return x to the power `share` within about 6 %, for x above 0: the exponent's bits, divided."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:  # noqa: ARG001
        zero = _all(_DOUBLES, float(0x3FF0000000000000))
        bits = builder.sitofp(builder.bitcast(values[0], _INTEGERS), _DOUBLES)
        divided = builder.fadd(builder.fmul(builder.fsub(bits, zero), values[1]), zero)
        return builder.bitcast(builder.fptosi(divided, _INTEGERS), _DOUBLES)

    return LANES(LANES, LANES), emit
