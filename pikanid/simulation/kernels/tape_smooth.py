@called
def run_tape(b, T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, p, first, output, row, inside,
             X, Y, J, x, S, before):
    """The classical Runge-Kutta method on a model without jumps; see `run` for the arguments."""
    n, m, A, L = b.sizes[0], b.sizes[1], S.shape[1], len(T)
    r, d, out, code = b.r, b.d, b.out, b.code
    prepare(b, p)
    for q in range(L):
        if delayed and jumps[q] and q > 0 and A > 0:
            # an input that comes later switches later: the state moves by (f- - f+) ddelay
            call_look(code[PUT], r, d, T[q], T[q] - T[q - 1], x, S, U[q - 1], V[q - 1], dtau_in)
            for j in range(m):
                call_native(code[VALUES_F], r, d)
                for i in range(n):
                    before[i] = r[out[F, i]]
                r[1 + n + j] = U[q, j]
                call_native(code[VALUES_F], r, d)
                for i in range(n):
                    for a in range(A):
                        S[i, a] += (before[i] - r[out[F, i]]) * dtau_in[j, a]
        if first[q] < first[q + 1]:
            show(b, q, x, S, U, V, T, first, output, row, inside, dtau_in, dtau_out, delayed, Y, J)
        if X.shape[0] > 0:
            for i in range(n):
                X[q, i] = x[i]
        if q == L - 1:
            break
        h = (T[q + 1] - T[q]) / pieces[q]
        for piece in range(pieces[q]):
            call_step(code[STEP_TANGENTS], r, d, T[q] + piece * h, piece * h, x, S, U[q], V[q],
                      dtau_in, h, x, S)
            for i in range(n):
                if not abs(x[i]) < 1e120:
                    return 1, q
    return 0, L - 1


@cached_jit(error_model="numpy", nogil=True)
def integrate_tape(b, T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, x0, S0, p, first, output,
                   row, inside, X, Y, J):
    """`run_tape` with its scratch; the only function that Python calls."""
    return run_tape(
        b, T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, p, first, output, row, inside,
        X, Y, J, x0.copy(), S0.T.copy(), x0.copy())
