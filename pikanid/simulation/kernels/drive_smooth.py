@inlined
def begin(t, first, x, S, u, v, ud, p, mode, act, w):
    """Nothing to prepare: a smooth model has no modes."""


@inlined
def advance(t, h, x, S, ta, ua, v, ud, p, mode, act, w):
    """One sub-step of length h, in place."""
    return 0 if step(t, h, x, S, ta, ua, v, ud, p, mode, act, w, x, S) else 1
