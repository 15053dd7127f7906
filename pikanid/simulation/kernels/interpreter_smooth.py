@called
def take_step(b, t, h, x, S, u, v, gap, dtau, delayed, xs, Ss, kx, kS):
    """One Runge-Kutta step of length h, in place; `gap` after the stop of u, v."""
    n, A = b.sizes[0], S.shape[1]
    r, d, live, out = b.r, b.d, b.live, b.out[F]
    if b.native[AROUND, F] != 0:
        call_step(b.native[AROUND_TANGENTS if A > 0 else AROUND, F], r, d, t, gap, x, S, u, v, dtau,
                  h, x, S)
        return
    for stage in range(4):
        c = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
        for i in range(n):
            xs[i] = x[i] if stage == 0 else x[i] + c * kx[stage - 1, i]
            for a in range(A):
                Ss[i, a] = S[i, a] if stage == 0 else S[i, a] + c * kS[stage - 1, i, a]
        put(b, t + c, xs, u, v, gap + c)
        put_tangents(b, Ss, v, dtau, delayed)
        values(b, b.group[F])
        tangents(b, b.group[F])
        for i in range(n):
            o = out[i]
            kx[stage, i] = r[o]
            for a in range(A):
                kS[stage, i, a] = d[o, a] if live[o] else 0.0
    for i in range(n):
        x[i] += h / 6.0 * (kx[0, i] + 2.0 * kx[1, i] + 2.0 * kx[2, i] + kx[3, i])
        for a in range(A):
            S[i, a] += h / 6.0 * (
                kS[0, i, a] + 2.0 * kS[1, i, a] + 2.0 * kS[2, i, a] + kS[3, i, a])


@called
def run_tape(b, T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, p, act, first, output, row,
             inside, X, Y, J, x, S, xs, Ss, kx, kS):
    """The classical Runge-Kutta method on a model without jumps; see `run` for the arguments."""
    n, A, L = b.sizes[0], len(act), len(T)
    r, out = b.r, b.out[F]
    prepare(b, p, act, delayed)
    for q in range(L):
        if delayed and jumps[q] and q > 0 and A > 0:
            # an input that comes later switches later: the state moves by (f- - f+) ddelay
            put(b, T[q], x, U[q - 1], V[q - 1], T[q] - T[q - 1])
            for j in range(b.sizes[1]):
                values(b, b.group[F])
                for i in range(n):
                    kx[0, i] = r[out[i]]
                r[1 + n + j] = U[q, j]
                values(b, b.group[F])
                for i in range(n):
                    for a in range(A):
                        S[i, a] += (kx[0, i] - r[out[i]]) * dtau_in[j, a]
        if first[q] < first[q + 1]:
            show(b, q, x, S, U, V, T, first, output, row, inside, dtau_in, dtau_out, delayed, Y, J)
        if X.shape[0] > 0:
            for i in range(n):
                X[q, i] = x[i]
        if q == L - 1:
            break
        h = (T[q + 1] - T[q]) / pieces[q]
        for piece in range(pieces[q]):
            gap = piece * h
            take_step(b, T[q] + gap, h, x, S, U[q], V[q], gap, dtau_in, delayed, xs, Ss, kx, kS)
            for i in range(n):
                if not abs(x[i]) < 1e120:
                    return 1, q
    return 0, L - 1


@njit(cache=True, error_model="numpy", nogil=True)
def integrate_tape(b, T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, x0, S0, p, act, first,
                   output, row, inside, X, Y, J):
    """`run_tape` with its scratch; the only function that Python calls."""
    n, A, S = b.sizes[0], len(act), S0.T.copy()
    return run_tape(
        b, T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, p, act, first, output, row, inside,
        X, Y, J, x0.copy(), S, x0.copy(), S.copy(), np.empty((4, n)), np.empty((4, n, A)))
