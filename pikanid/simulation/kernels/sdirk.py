STAGES = 5  # definition: of the method


@called
def step(t, h, x, S, ta, ua, v, ud, p, mode, act, w, xn, Sn):
    """One step of the singly diagonally implicit Runge-Kutta method, state and sensitivities.

    Stage equations are solved by Newton's method; the stages' sensitivities then satisfy linear
    equations with the same matrix I - h/4 f_x, so that they belong to the discrete step exactly.
    """
    kx, kS, xt, St, u = w.kx, w.kS, w.xt, w.St, w.u
    n, A = N, len(act)
    fx, matrix, start, change = w.fx, w.matrix, w.start, w.change
    for stage in range(5):
        ts = t + NODES[stage] * h
        for j in range(M):
            u[j] = ua[j] + v[j] * (ts - ta)
        for i in range(n):
            start[i] = x[i]
            for j in range(stage):
                start[i] += h * SDIRK[stage, j] * kx[j, i]
            kx[stage, i] = kx[stage - 1, i] if stage > 0 else 0.0
        solved = False
        for _ in range(30):
            size, move = 0.0, 0.0
            for i in range(n):
                xt[i] = start[i] + 0.25 * h * kx[stage, i]
            field(ts, xt, w.eye, u, v, w.still, p, mode, w.constant[:], w, w.f[:], fx[:])
            for i in range(n):
                for j in range(n):
                    matrix[i, j] = (1.0 if i == j else 0.0) - 0.25 * h * fx[j, i]
                    if not math.isfinite(matrix[i, j]):
                        return False
            for i in range(n):
                change[i, 0] = w.f[i] - kx[stage, i]
            solve_small(matrix[:n, :n], change[:n])
            for i in range(n):
                kx[stage, i] += change[i, 0]
                move = max(move, abs(change[i, 0]) * h)
                size = max(size, abs(xt[i]))
            if not math.isfinite(move):
                return False
            if move <= 1e-13 * (1e-3 + size):
                solved = True
                break
        if not solved:
            return False
        if A > 0:
            for i in range(n):
                xt[i] = start[i] + 0.25 * h * kx[stage, i]
                for a in range(A):
                    St[a, i] = S[a, i]
                    for j in range(stage):
                        St[a, i] += h * SDIRK[stage, j] * kS[j, a, i]
            field(ts, xt, St, u, v, ud, p, mode, act, w, w.f[:], kS[stage])
            for i in range(n):
                for j in range(n):
                    matrix[i, j] = (1.0 if i == j else 0.0) - 0.25 * h * fx[j, i]
            for i in range(n):
                for a in range(A):
                    w.right[i, a] = kS[stage, a, i]
            solve_small(matrix[:n, :n], w.right[:, :A])
            for i in range(n):
                for a in range(A):
                    kS[stage, a, i] = w.right[i, a]
    for i in range(n):
        xn[i] = x[i]
        for a in range(A):
            Sn[a, i] = S[a, i]
        for j in range(5):
            xn[i] += h * SDIRK[4, j] * kx[j, i]
            for a in range(A):
                Sn[a, i] += h * SDIRK[4, j] * kS[j, a, i]
    return True
