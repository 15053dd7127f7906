@inlined
def signs(t, x, u, v, p, mode, w):
    """A smooth model has no switching functions."""


@inlined
def show_signs(t, x, S, u, v, p, mode, act, w):
    """Outputs of a smooth model show no signs."""


@inlined
def field_value(t, x, u, v, p, mode, w, f):
    """The right-hand side."""
    rhs(w.bs, t, x, u, p, mode, f)


@inlined
def field(t, x, S, u, v, ud, p, mode, act, w, f, dS):
    """The right-hand side and, for the columns of S, its variation."""
    if len(act) == 0:
        rhs(w.bs, t, x, u, p, mode, f)
    else:
        variational(w.bs, t, x, S, u, ud, p, mode, act, f, w.fp, dS)
