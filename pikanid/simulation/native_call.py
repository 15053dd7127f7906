"""How compiled functions call machine code by its address."""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import intrinsic


@intrinsic
def call_native(context: Any, address: Any, r: Any, d: Any) -> Any:
    """Call the function at `address` with pointers to the first elements of two arrays."""
    return types.void(types.int64, r, d), _calling


@intrinsic
def call_look(context: Any, address: Any, r: Any, d: Any, t: Any, gap: Any, x: Any, S: Any, u: Any,
              v: Any, dtau: Any) -> Any:
    """Call a look (`native_step.LOOK`) at `address`; all arrays are contiguous."""
    return types.void(types.int64, r, d, types.f8, types.f8, x, S, u, v, dtau), _calling


@intrinsic
def call_step(context: Any, address: Any, r: Any, d: Any, t: Any, gap: Any, x: Any, S: Any, u: Any,
              v: Any, dtau: Any, h: Any, xn: Any, Sn: Any) -> Any:
    """Call a step (`native_step.STEP`) at `address`; all arrays are contiguous."""
    f8 = types.f8
    return types.void(types.int64, r, d, f8, f8, x, S, u, v, dtau, f8, xn, Sn), _calling


def _calling(target: Any, builder: Any, signature: Any, values: Any) -> Any:
    from llvmlite import ir

    address, *rest = values
    passed = [target.make_array(kind)(target, builder, value=value).data
              if isinstance(kind, types.Array) else value
              for kind, value in zip(signature.args[1:], rest, strict=True)]
    function = ir.FunctionType(ir.VoidType(), [value.type for value in passed])
    builder.call(builder.inttoptr(address, function.as_pointer()), passed)
    return target.get_dummy_value()
