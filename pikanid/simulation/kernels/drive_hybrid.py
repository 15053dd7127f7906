@called
def input_at(t, ta, ua, v, w):
    for j in range(M):
        w.u[j] = ua[j] + v[j] * (t - ta)


@called
def rates_beside(k, t, x, u, v, p, mode, w):
    """d g_k/dt just below and just above its surface."""
    kept = mode[k]
    mode[k] = -1.0
    resolve(t, x, u, v, p, mode, w)
    switching_rate(w.bs, t, x, u, v, p, w.s, w.G)
    below = w.G[k]
    mode[k] = 1.0
    resolve(t, x, u, v, p, mode, w)
    switching_rate(w.bs, t, x, u, v, p, w.s, w.G)
    above = w.G[k]
    mode[k] = kept
    return below, above


@called
def begin(t, x, S, u, v, ud, p, mode, act, w):
    """Choose the modes where an interval starts; a jump of an input may have changed them.

    Where a jump frees or catches a sliding surface nothing else jumps: its instant is given, so
    the sensitivities go on unchanged.
    """
    for k in range(K):
        w.s[k] = mode[k]
    for k in range(K):
        switching(w.bs, t, x, u, p, w.s, w.g)
        g = w.g[k]
        if mode[k] != 0.0 and abs(g) > 1e-12:
            mode[k] = 1.0 if g > 0.0 else -1.0
        else:
            below, above = rates_beside(k, t, x, u, v, p, mode, w)
            if above < 0.0 < below:
                mode[k] = 0.0
            elif above >= 0.0 and below >= 0.0:
                mode[k] = 1.0
            elif above <= 0.0 and below <= 0.0:
                mode[k] = -1.0
            else:
                mode[k] = 1.0 if abs(above) >= abs(below) else -1.0
        w.s[k] = mode[k]
    return True


@called
def margins(t, x, ta, ua, v, p, mode, w, phi):
    """How far each mode is from its end: >= 0 while it holds."""
    input_at(t, ta, ua, v, w)
    resolve(t, x, w.u, v, p, mode, w)
    switching(w.bs, t, x, w.u, p, w.s, w.g)
    least, which = np.inf, -1
    for k in range(K):
        phi[k] = 1.0 - abs(w.s[k]) if mode[k] == 0.0 else mode[k] * w.g[k]
        if phi[k] < least:
            least, which = phi[k], k
    return least, which


@called
def locate(t, h, x, ta, ua, v, p, mode, w, end):
    """The step length at which the first mode ends: bisection with regula falsi steps."""
    phi = w.phi
    low, high, f_low, f_high = 0.0, h, 0.0, end
    which = -1
    for count in range(100):
        if high - low <= 1e-15 * max(abs(t), h) + 1e-14 * h:
            break
        middle = 0.5 * (low + high)
        if f_low > 0.0 and count % 3 != 2:
            middle = low + (high - low) * f_low / (f_low - f_high)
            edge = 1e-3 * (high - low) if count % 3 == 0 else 0.0
            middle = min(max(middle, low + edge), high - edge)
        step(t, middle, x, w.none, ta, ua, v, w.nud, p, mode, w.nact, w, w.xn, w.none)
        value, k = margins(t + middle, w.xn, ta, ua, v, p, mode, w, phi)
        if value < 0.0:
            high, f_high, which = middle, value, k
        else:
            low, f_low = middle, value
    if which < 0:
        step(t, high, x, w.none, ta, ua, v, w.nud, p, mode, w.nact, w, w.xn, w.none)
        _, which = margins(t + high, w.xn, ta, ua, v, p, mode, w, phi)
    return high, which


@called
def cross(k, t, x, S, ta, ua, v, ud, p, mode, act, w):
    """End mode k at the point reached: pass, stick, or come loose; sensitivities jump.

    S+ = S- + (f- - f+) dt_e/dtheta with dt_e/dtheta = -(g_x S + g_u ∂u + g_p)/(dg/dt)-
    (saltation; Di Bernardo et al., Piecewise-smooth Dynamical Systems, 2008, sec. 2.5).
    """
    A = len(act)
    input_at(t, ta, ua, v, w)
    u, before, after = w.uc, w.before, w.after
    for j in range(M):
        u[j] = w.u[j]
    if mode[k] == 0.0:
        resolve(t, x, u, v, p, mode, w)
        mode[k] = 1.0 if w.s[k] > 0.0 else -1.0
        return
    field_value(t, x, u, v, p, mode, w, before)
    switching_rate(w.bs, t, x, u, v, p, w.s, w.G)
    rate, side = w.G[k], mode[k]
    if A > 0:
        switching_sensitivity(w.bs, t, x, S, u, ud, p, w.s, act, w.gp, w.gS)
    below, above = rates_beside(k, t, x, u, v, p, mode, w)
    beyond = below if side > 0.0 else above
    mode[k] = 0.0 if side * beyond > 0.0 else -side
    if A > 0 and rate != 0.0:
        field_value(t, x, u, v, p, mode, w, after)
        for a in range(A):
            when = -w.gS[k, a] / rate
            for i in range(N):
                S[a, i] += (before[i] - after[i]) * when


@called
def advance(t, h, x, S, ta, ua, v, ud, p, mode, act, w):
    """One sub-step of length h, in place, stopping at every switch inside it."""
    done, events = 0.0, 0
    while done < h:
        rest = h - done
        if not step(t + done, rest, x, w.none, ta, ua, v, w.nud, p, mode, w.nact, w, w.xn, w.none):
            return 1
        for i in range(N):
            if not math.isfinite(w.xn[i]):
                return 1
        end, which = margins(t + h, w.xn, ta, ua, v, p, mode, w, w.phi)
        if end < -1e-14:
            part, which = locate(t + done, rest, x, ta, ua, v, p, mode, w, end)
        else:
            part, which = rest, -1
        if len(act) > 0 or which >= 0:
            if not step(t + done, part, x, S, ta, ua, v, ud, p, mode, act, w, w.xn, w.Sn):
                return 1
        for i in range(N):
            x[i] = w.xn[i]
            for a in range(len(act)):
                S[a, i] = w.Sn[a, i]
        done = h if which < 0 else done + part
        if which >= 0:
            cross(which, t + done, x, S, ta, ua, v, ud, p, mode, act, w)
            events += 1
            if events > 1000:
                return 2
    return 0
