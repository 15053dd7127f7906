@inlined
def begin(t, first, x, S, u, v, ud, p, mode, act, w):
    """Nothing to prepare: a smooth model has no modes."""


@inlined
def advance(t, h, x, S, ta, ua, v, ud, p, mode, act, w):
    """One sub-step of length h, in place."""
    if not step(t, h, x, S, ta, ua, v, ud, p, mode, act, w, w.xn, w.Sn):
        return 1
    for i in range(N):
        x[i] = w.xn[i]
        for a in range(len(act)):
            S[a, i] = w.Sn[a, i]
    return 0
