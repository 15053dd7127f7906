"""How compiled functions call machine code by its address."""

from __future__ import annotations

from typing import Any

from numba import types
from numba.extending import intrinsic


@intrinsic
def call_native(context: Any, address: Any, r: Any, d: Any) -> Any:
    """Call the function at `address` with pointers to the first elements of two arrays."""
    from llvmlite import ir

    def generate(target: Any, builder: Any, signature: Any, values: Any) -> Any:
        data = [target.make_array(kind)(target, builder, value=value).data
                for kind, value in zip(signature.args[1:], values[1:], strict=True)]
        kind = ir.FunctionType(ir.VoidType(), [pointer.type for pointer in data])
        builder.call(builder.inttoptr(values[0], kind.as_pointer()), data)
        return target.get_dummy_value()

    return types.void(types.int64, r, d), generate
