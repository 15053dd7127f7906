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
        Y[row] = w.y[o]
        for a in range(A):
            J[row, a] = w.J[o, a]
        if moves and seen.inside[q]:
            observe_rate(w.bs, t, x, u, v, p, s, w.y)
            for a in range(A):
                J[row, a] -= w.y[o] * dtau_out[o, a]


@called
def run(T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, x0, S0, p, act, mode, w, seen,
        X, Y, J):
    """Integrate over the stops T, recording observations; returns (status, stop reached).

    T (L,) stops; pieces (L-1,) sub-steps of each interval; U, V (L-1, M) inputs at the start of
    each interval and their slopes; jumps (L-1,) whether an input jumps where the interval starts;
    dtau_* (channels, A) how each delay depends on the estimated parameters.
    Status 0: done; 1: not finite; 2: endless switching.
    """
    n, A = N, len(act)
    x, S, ud, before, after, held = w.x, w.S, w.ud, w.before, w.after, w.held
    for r in range(n):
        x[r] = x0[r]
        for a in range(A):
            S[a, r] = S0[a, r]
    L = len(T)
    for i in range(L):
        last = i == L - 1
        k = i - 1 if last else i
        v = V[k]
        ta = T[k]
        for j in range(M):
            held[j] = U[k, j] + v[j] * (T[i] - ta)
        if not last:
            if jumps[i] and i > 0 and A > 0 and delayed:
                gap = T[i] - T[i - 1]
                for j in range(M):
                    held[j] = U[i - 1, j] + V[i - 1, j] * gap
                for j in range(M):
                    field_value(T[i], x, held, v, p, mode, w, before)
                    held[j] = U[i, j]
                    field_value(T[i], x, held, v, p, mode, w, after)
                    for a in range(A):
                        for r in range(n):
                            S[a, r] += (before[r] - after[r]) * dtau_in[j, a]
            if delayed:
                for j in range(M):
                    for a in range(A):
                        ud[j, a] = -v[j] * dtau_in[j, a]
            if jumps[i]:
                begin(T[i], x, S, held, v, ud, p, mode, act, w)
        record(i, T[i], x, S, held, v, p, mode, act, w, seen, delayed, dtau_in, dtau_out, Y, J)
        if X.shape[0] > 0:
            for r in range(n):
                X[i, r] = x[r]
        if last:
            break
        h = (T[i + 1] - T[i]) / pieces[i]
        for piece in range(pieces[i]):
            status = advance(T[i] + piece * h, h, x, S, ta, U[i], v, ud, p, mode, act, w)
            if status != 0:
                return status, i
        for r in range(n):
            if not abs(x[r]) < 1e120:
                return 1, i
    return 0, L - 1


@njit(cache=True, error_model="numpy")
def integrate(T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, x0, S0, p, act, first, output,
              row, inside, X, Y, J):
    """`run` with its scratch; the only function of a model that Python calls."""
    w = make_work(N, M, P, Q, K, len(act), STAGES, BUFFERS[0], BUFFERS[1])
    return run(T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, x0, S0, p, act, np.ones(K), w,
               Seen(first, output, row, inside), X, Y, J)
