STAGES = 1  # definition: each is used up before the next


@hot
def step(t, h, x, S, ta, ua, v, ud, p, mode, act, w, xn, Sn):
    """One classical Runge-Kutta step of the state and its sensitivities."""
    k, kS, xt, St, u = w.kx[0], w.kS[0], w.xt, w.St, w.u
    n, A = N, len(act)
    for i in range(n):
        xt[i] = x[i]
        xn[i] = x[i]
    for a in range(A):
        for i in range(n):
            St[a, i] = S[a, i]
            Sn[a, i] = S[a, i]
    for stage in range(4):
        ts = t if stage == 0 else (t + h if stage == 3 else t + 0.5 * h)
        ahead = 0.5 * h if stage < 2 else h
        share = h / 6.0 if stage == 0 or stage == 3 else h / 3.0
        for j in range(M):
            u[j] = ua[j] + v[j] * (ts - ta)
        field(ts, xt, St, u, v, ud, p, mode, act, w, k, kS)
        for i in range(n):
            xt[i] = x[i] + ahead * k[i]
            xn[i] += share * k[i]
        for a in range(A):
            for i in range(n):
                St[a, i] = S[a, i] + ahead * kS[a, i]
                Sn[a, i] += share * kS[a, i]
    return True
