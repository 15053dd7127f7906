"""What can be wrong with a spline or a network."""

from __future__ import annotations


def kan_width(width: object) -> str:
    return (f"width = {width} cannot make a KAN: list the nodes of at least two layers, each 1 or "
            "more (or [sums, products]), the first without products.")


def kan_not_shallow(width: object) -> str:
    return f"A KAN of width {width} is not shallow: this needs one input and one layer of edges."


def kan_not_a_curve(width: object) -> str:
    return (f"A KAN of width {width} is no curve over time: it needs one input, one output and no "
            "masked edges, as in (1, 5, 1).")


def kan_order(order: int, highest: int) -> str:
    return (
        f"A deep KAN carries time derivatives up to order {highest}, not {order}: give every state "
        'its own network with form="state", or use a shallow one, width=(1, 1).'
    )


def kan_kinks(count: int, most: int) -> str:
    return (f"The inputs switch so often that a deep KAN would need {count} kinks beside it, more "
            f"than {most}: use a shallow one, width=(1, 1).")


def kan_device(device: str, detail: str) -> str:
    return f"device = '{device}' cannot hold a KAN ({detail}): use device='cpu'."


def kan_symbolic(layer: int) -> str:
    return (f"Layer {layer} of the KAN has symbolic edges: only spline edges have coefficients to "
            "estimate; unfix_symbolic(...) them first.")


def kan_knots(layer: int) -> str:
    return f"The knots of layer {layer} of the KAN are not uniform: refit it on a uniform grid."


def kan_outside(low: float, high: float, start: float, stop: float) -> str:
    return (f"Times {low:g} to {high:g} s leave the KAN's grid [{start:g}, {stop:g}] s: build it "
            "with a grid_range that covers them.")


def kan_kink(time: float, start: float, stop: float) -> str:
    return f"A kink at t = {time:g} s does not lie inside the KAN's grid ({start:g}, {stop:g}) s."


def kan_kink_elsewhere(time: float) -> str:
    return (f"The kink at t = {time:g} s belongs to other knots than the KAN's: carry curve and "
            "kinks over together, with `refined`.")



def kan_points(x: object, y: object, inputs: int, outputs: int) -> str:
    return (f"A KAN with {inputs} inputs and {outputs} outputs cannot be fitted to x {x} and y "
            f"{y}: give finite x (points, inputs) and y (points,) and a KAN with one output.")


def kan_coefficients(given: object, wanted: object) -> str:
    return f"The KAN takes coefficients of shape {wanted}, not {given}."


def spline_knots(degree: int, count: int) -> str:
    return (f"A spline of degree {degree} needs degree >= 1 and at least {2 * (degree + 1)} knots, "
            f"not {count}: ask for more intervals or a lower degree.")


def spline_knots_unsorted() -> str:
    return "The knots of a spline must be finite and must not decrease: sort them."


def outside_spline(start: float, stop: float) -> str:
    return (f"A spline from {start:g} to {stop:g} s has no value outside: ask for times between "
            "them.")
