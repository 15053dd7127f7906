STAGES = 4  # definition: sensitivities go through them after the state


@hot
def step(t, h, x, S, ta, ua, v, ud, p, mode, act, w, xn, Sn):
    """One classical Runge-Kutta step of the state and then of its sensitivities; may be in place.

    Tuples rather than arrays: they are values, which the compiler keeps in registers.
    """
    start = state(x)
    here, end = start, start
    for stage in range(4):
        ts = t if stage == 0 else (t + h if stage == 3 else t + 0.5 * h)
        ahead = 0.5 * h if stage < 2 else h
        share = h / 6.0 if stage == 0 or stage == 3 else h / 3.0
        f = slope(w.bs, ts, here, inputs(ua, v, ts - ta), p, mode, w.by[stage], w.stage_fp[stage])
        here, end = moved(start, ahead, f), moved(end, share, f)
    for i in range(N):
        xn[i] = end[i]
    for a in range(len(act)):
        start = state(S[a])
        here, end = start, start
        for stage in range(4):
            ahead = 0.5 * h if stage < 2 else h
            share = h / 6.0 if stage == 0 or stage == 3 else h / 3.0
            f = column_slope(here, ud, a, act[a], w.by[stage], w.stage_fp[stage])
            here, end = moved(start, ahead, f), moved(end, share, f)
        for i in range(N):
            Sn[a, i] = end[i]
    return True
