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
                St[a, i] = S[a, i] if stage == 0 else S[a, i] + c * h * kS[stage - 1, a, i]
        ts = t + c * h
        for j in range(M):
            u[j] = ua[j] + v[j] * (ts - ta)
        field(ts, xt, St, u, v, ud, p, mode, act, w, kx[stage], kS[stage])
    for i in range(n):
        xn[i] = x[i] + h / 6.0 * (kx[0, i] + 2.0 * kx[1, i] + 2.0 * kx[2, i] + kx[3, i])
        for a in range(A):
            Sn[a, i] = S[a, i] + h / 6.0 * (
                kS[0, a, i] + 2.0 * kS[1, a, i] + 2.0 * kS[2, a, i] + kS[3, a, i])
    return True
