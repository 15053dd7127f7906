"""How compiled functions call machine code by its address."""

from __future__ import annotations

import functools
from typing import Any

from numba import types
from numba.core.sigutils import normalize_signature
from numba.extending import intrinsic

# of the `integrate` of every model, see `kernels/integrate`: what it takes and returns
INTEGRATE = ("UniTuple(int64, 2)(f8[::1], i8[::1], f8[:,::1], f8[:,::1], b1[::1], f8[:,::1], "
             "f8[:,::1], b1, f8[::1], f8[:,::1], f8[::1], i8[::1], i8[::1], i8[::1], i8[::1], "
             "b1[::1], f8[:,::1], f8[::1], f8[:,::1])")  # definition: a signature


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


@intrinsic
def call_integrate(context: Any, address: Any, arguments: Any) -> Any:
    """Call a model's `integrate` at `integrate_address`; its status, or -1: an error."""
    taken, returned = normalize_signature(INTEGRATE)

    def calling(target: Any, builder: Any, signature: Any, values: Any) -> Any:
        convention = target.call_conv
        kind = convention.get_function_type(returned, taken)
        given = [target.cast(builder, builder.extract_value(values[1], i), *kinds)
                 for i, kinds in enumerate(zip(arguments, taken, strict=True))]
        outcome, pair = convention.call_function(
            builder, builder.inttoptr(values[0], kind.as_pointer()), returned, taken, given)
        status = builder.extract_value(pair, 0)
        return builder.select(outcome.is_ok, status, status.type(-1))
    return types.int64(types.int64, arguments), calling


@functools.lru_cache(maxsize=256)  # as many as there are modules of models
def integrate_address(integrate: Any) -> int:
    """Where a model's compiled `integrate` lies in memory; 0 where it is not of that kind."""
    taken, returned = normalize_signature(INTEGRATE)
    made = getattr(integrate, "overloads", {}).get(taken)
    if made is None or made.signature.return_type != returned:
        return 0
    return int(made.library.get_pointer_to_function(made.fndesc.llvm_func_name))


def _calling(target: Any, builder: Any, signature: Any, values: Any) -> Any:
    from llvmlite import ir

    address, *rest = values
    passed = [target.make_array(kind)(target, builder, value=value).data
              if isinstance(kind, types.Array) else value
              for kind, value in zip(signature.args[1:], rest, strict=True)]
    function = ir.FunctionType(ir.VoidType(), [value.type for value in passed])
    builder.call(builder.inttoptr(address, function.as_pointer()), passed)
    return target.get_dummy_value()
