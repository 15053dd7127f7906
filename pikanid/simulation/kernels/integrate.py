@inlined
def record(i, t, x, S, u, v, p, mode, act, w, seen, moves, dtau_in, dtau_out, Y, J):
    """Write the observations that belong to the i-th stop."""
    A = len(act)
    if seen.first[i] == seen.first[i + 1]:
        return
    signs(t, x, u, v, p, mode, w)
    s = w.s
    for q in range(seen.first[i], seen.first[i + 1]):
        o, row = seen.output[q], seen.row[q]
        if A == 0:
            observe(w.bs, t, x, u, p, s, w.y)
            Y[row] = w.y[o]
            continue
        observe_sensitivity(w.bs, t, x, S, u, w.ud, p, s, act, w.y, w.hp, w.J)
        show_signs(t, x, S, u, v, p, mode, act, w)
        Y[row] = w.y[o]
        for a in range(A):
            J[row, a] = w.J[o, a]
        if moves and seen.inside[q]:
            observe_rate(w.bs, t, x, u, v, p, s, w.y)
            for a in range(A):
                J[row, a] -= w.y[o] * dtau_out[row, a]


@called
def switch_inputs(t, i, x, S, U, V, gap, dtau_in, delayed, p, mode, act, w):
    """Bring the inputs to their values right of stop i, where one jumps or kinks.

    An input that comes `delay` late switches later by that delay: its switch moves S by
    (f- - f+) ddelay/dtheta.  Inputs switch one after the other, each with the modes it finds.
    """
    A = len(act)
    for j in range(M):
        w.uc[j] = U[i, j] if i == 0 else U[i - 1, j] + V[i - 1, j] * gap
        w.held[j], w.slope[j] = U[i, j], V[i, j]
        if delayed:
            for a in range(A):
                w.ud[j, a] = -V[i, j] * dtau_in[j, a]
    if not delayed or i == 0 or A == 0:
        begin(t, i == 0, x, S, w.held, w.slope[:], w.ud, p, mode, act, w)
        return
    for j in range(M):
        w.held[j], w.slope[j] = w.uc[j], V[i - 1, j]
    for j in range(M):
        field_value(t, x, w.held, w.slope[:], p, mode, w, w.start[:])
        w.held[j], w.slope[j] = U[i, j], V[i, j]
        begin(t, False, x, S, w.held, w.slope[:], w.ud, p, mode, act, w)
        w.uc[j] = U[i, j]
        field_value(t, x, w.held, w.slope[:], p, mode, w, w.f[:])
        for a in range(A):
            for r in range(N):
                S[a, r] += (w.start[r] - w.f[r]) * dtau_in[j, a]


@called
def run(T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, x0, S0, given, act, mode, work, seen,
        X, Y, J):
    """Integrate over the stops T, recording observations; returns (status, stop reached).

    T (L,) stops; pieces (L-1,) sub-steps of each interval; U, V (L, M) inputs right of each stop
    and their slopes; jumps (L,) whether an input jumps or kinks there;
    given (P,) parameters, to which p adds what depends on them alone;
    dtau_* (channels, A) how each delay depends on the estimated parameters.
    Status 0: done; 1: not finite; 2: endless switching.
    """
    w = work[0]
    for i in range(N):
        w.eye[i, i] = 1.0
        w.constant[i] = P
    p, n, A = w.p[:], N, len(act)
    evaluate_constants(given, p)
    x, S = w.x, w.S
    for r in range(n):
        x[r] = x0[r]
        for a in range(A):
            S[a, r] = S0[a, r]
    L = len(T)
    for i in range(L):
        v, ta = V[i], T[i]
        if jumps[i]:
            gap = T[i] - T[i - 1] if i > 0 else 0.0
            switch_inputs(ta, i, x, S, U, V, gap, dtau_in, delayed, p, mode, act, w)
        else:
            for j in range(M):
                w.held[j] = U[i, j]
        record(i, ta, x, S, w.held, v, p, mode, act, w, seen, delayed, dtau_in, dtau_out, Y, J)
        if X.shape[0] > 0:
            for r in range(n):
                X[i, r] = x[r]
        if i == L - 1:
            break
        h = (T[i + 1] - ta) / pieces[i]
        for piece in range(pieces[i]):
            status = advance(ta + piece * h, h, x, S, ta, U[i], v, w.ud, p, mode, act, w)
            if status != 0:
                return status, i
        for r in range(n):
            if not abs(x[r]) < 1e120:
                return 1, i
    return 0, L - 1


WORK = work_dtype(N, M, P, Q, K, STAGES, CONSTANTS, *BUFFERS)


@cached_jit(error_model="numpy")
def integrate(T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, x0, S0, p, act, first, output,
              row, inside, X, Y, J):
    """`run` with its scratch; the only function of a model that Python calls.

    The scratch goes there as an array: a record does not keep the memory alive that it lies in.
    """
    work = np.zeros(1, WORK)
    return run(T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, x0, S0, p, act, np.ones(K), work,
               Seen(first, output, row, inside), X, Y, J)
