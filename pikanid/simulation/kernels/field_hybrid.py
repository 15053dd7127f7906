@called
def sliding_indices(mode, index):
    """List the switching functions that are held at zero; returns how many."""
    count = 0
    for k in range(K):
        if mode[k] == 0.0:
            index[count] = k
            count += 1
    return count


@called
def resolve(t, x, u, v, p, mode, w):
    """Fill w.s: the sign of each switching function, or the value that holds a sliding one at 0.

    On a sliding surface s follows from d g/dt = G(x, u, t; s) = 0, which is linear in s.
    """
    s = w.s
    for k in range(K):
        s[k] = mode[k]
    sliding = sliding_indices(mode, w.held_at_zero)
    if sliding == 0:
        return
    switching_rate(w.bs, t, x, u, v, p, s, w.G)
    w.Gs[:, :] = 0.0
    switching_gain(w.bs, t, x, u, v, p, s, w.Gs)
    if sliding == 1:
        for k in range(K):
            if mode[k] == 0.0 and w.Gs[k, k] != 0.0:
                s[k] -= w.G[k] / w.Gs[k, k]
        return
    for i in range(sliding):
        w.change[i, 0] = -w.G[w.held_at_zero[i]]
        for j in range(sliding):
            w.matrix[i, j] = w.Gs[w.held_at_zero[i], w.held_at_zero[j]]
    solve_small(w.matrix[:sliding, :sliding], w.change[:sliding])
    for i in range(sliding):
        s[w.held_at_zero[i]] += w.change[i, 0]


@called
def signs(t, x, u, v, p, mode, w):
    """Fill w.s with the s_k of the present mode."""
    resolve(t, x, u, v, p, mode, w)


@called
def field_value(t, x, u, v, p, mode, w, f):
    """The right-hand side in the present mode (Filippov's on a sliding surface)."""
    resolve(t, x, u, v, p, mode, w)
    rhs(w.bs, t, x, u, p, w.s, f)


@called
def sliding_signs(t, x, S, u, v, ud, p, act, sliding, w):
    """Fill w.ds: how the signs of the sliding surfaces vary, from dG = 0; and w.Fs = ∂f/∂s."""
    A = len(act)
    w.Gs[:, :] = 0.0
    w.Fs[:, :] = 0.0
    switching_rate_sensitivity(w.bs, t, x, S, u, v, ud, p, w.s, act, w.rp, w.GS, w.Gs, w.Fs)
    for i in range(sliding):
        for j in range(sliding):
            w.matrix[i, j] = w.Gs[w.held_at_zero[i], w.held_at_zero[j]]
        for a in range(A):
            w.ds[i, a] = -w.GS[w.held_at_zero[i], a]
    solve_small(w.matrix[:sliding, :sliding], w.ds[:sliding, :A])


@called
def show_signs(t, x, S, u, v, p, mode, act, w):
    """Add to w.J what outputs see of the signs of sliding surfaces: a friction force, say."""
    sliding = sliding_indices(mode, w.held_at_zero)
    if sliding == 0 or not SHOWS_SIGNS:
        return
    sliding_signs(t, x, S, u, v, w.ud, p, act, sliding, w)
    w.Hs[:, :] = 0.0
    observe_gain(w.bs, t, x, u, v, p, w.s, w.Hs)
    for o in range(Q):
        for i in range(sliding):
            for a in range(len(act)):
                w.J[o, a] += w.Hs[o, w.held_at_zero[i]] * w.ds[i, a]


@inlined
def field(t, x, S, u, v, ud, p, mode, act, w, f, dS):
    """The right-hand side and its variation; on a sliding surface s varies too: dG = 0."""
    resolve(t, x, u, v, p, mode, w)
    A = len(act)
    if A == 0:
        rhs(w.bs, t, x, u, p, w.s, f)
        return
    variational(w.bs, t, x, S, u, ud, p, w.s, act, f, w.fp, dS)
    sliding = sliding_indices(mode, w.held_at_zero)
    if sliding == 0:
        return
    sliding_signs(t, x, S, u, v, ud, p, act, sliding, w)
    for r in range(N):
        for i in range(sliding):
            push = w.Fs[r, w.held_at_zero[i]]
            if push != 0.0:
                for a in range(A):
                    dS[a, r] += push * w.ds[i, a]
