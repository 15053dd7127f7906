STAGES = 4


@hot
def step(t, h, x, S, ta, ua, v, ud, p, mode, act, w, xn, Sn):
    """One classical Runge-Kutta step of the state and its sensitivities."""
    kx, kS, xt, St, u = w.kx, w.kS, w.xt, w.St, w.u
    n, A = N, len(act)
    for stage in range(4):
        c = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
        for i in range(n):
            xt[i] = x[i] if stage == 0 else x[i] + c * h * kx[stage - 1, i]
            for a in range(A):
                St[i, a] = S[i, a] if stage == 0 else S[i, a] + c * h * kS[stage - 1, i, a]
        ts = t + c * h
        for j in range(M):
            u[j] = ua[j] + v[j] * (ts - ta)
        field(ts, xt, St, u, v, ud, p, mode, act, w, kx[stage], kS[stage])
    for i in range(n):
        xn[i] = x[i] + h / 6.0 * (kx[0, i] + 2.0 * kx[1, i] + 2.0 * kx[2, i] + kx[3, i])
        for a in range(A):
            Sn[i, a] = S[i, a] + h / 6.0 * (
                kS[0, i, a] + 2.0 * kS[1, i, a] + 2.0 * kS[2, i, a] + kS[3, i, a])
    return True
