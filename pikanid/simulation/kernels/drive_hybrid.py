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
def mode_at_zero(k, t, x, u, v, p, mode, w):
    """The mode of a switching function that is at zero: the flow beside its surface decides."""
    below, above = rates_beside(k, t, x, u, v, p, mode, w)
    if above < 0.0 < below:
        return 0.0
    if above == 0.0 and below == 0.0:
        # a function of held inputs stays at zero, sgn 0 = 0; one of the state may yet move off
        return 0.0 if INPUT_ONLY[k] else (1.0 if mode[k] == 0.0 else mode[k])
    if above >= 0.0 and below >= 0.0:
        return 1.0
    if above <= 0.0 and below <= 0.0:
        return -1.0
    return 1.0 if abs(above) >= abs(below) else -1.0


@called
def leap(k, new, t, x, S, u, v, ud, p, mode, act, w):
    """Set mode k to `new` where its switching function passes zero; sensitivities jump.

    S+ = S- + (f- - f+) dt_e/dtheta with dt_e/dtheta = -(g_x S + g_u ∂u + g_p)/(dg/dt)-
    (saltation; Di Bernardo et al., Piecewise-smooth Dynamical Systems, 2008, sec. 2.5).
    """
    A = len(act)
    field_value(t, x, u, v, p, mode, w, w.before[:])
    switching_rate(w.bs, t, x, u, v, p, w.s, w.G)
    rate = w.G[k]
    if A > 0:
        switching_sensitivity(w.bs, t, x, S, u, ud, p, w.s, act, w.gp, w.gS)
    mode[k] = new
    if A > 0 and rate != 0.0:
        field_value(t, x, u, v, p, mode, w, w.after[:])
        for a in range(A):
            when = -w.gS[k, a] / rate
            for i in range(N):
                S[a, i] += (w.before[i] - w.after[i]) * when


@called
def begin(t, first, x, S, u, v, ud, p, mode, act, w):
    """Choose the modes where inputs go from w.uc to u; the jump may have changed them.

    Where the jump itself frees or catches a surface, or carries a switching function past zero,
    sensitivities go on unchanged: the instant is given.  Only a function that passes zero by the
    flow just there (a switching time guessed on an input's) makes them jump.
    """
    for k in range(K):
        resolve(t, x, u, v, p, mode, w)
        switching(w.bs, t, x, w.uc, p, w.s, w.g)
        drift = w.g[k] if mode[k] == 0.0 else 0.0
        switching(w.bs, t, x, u, p, w.s, w.g)
        if abs(w.g[k] - drift) > 1e-12:
            mode[k] = 1.0 if w.g[k] > 0.0 else -1.0
            continue
        new = mode_at_zero(k, t, x, u, v, p, mode, w)
        if not first and mode[k] * new < 0.0:
            leap(k, new, t, x, S, u, v, ud, p, mode, act, w)
        mode[k] = new


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
def look_at(t, x, ta, ua, v, p, mode, w):
    """Fill w.g and w.G: the switching functions and their rates."""
    input_at(t, ta, ua, v, w)
    resolve(t, x, w.u, v, p, mode, w)
    switching(w.bs, t, x, w.u, p, w.s, w.g)
    switching_rate(w.bs, t, x, w.u, v, p, w.s, w.G)


@called
def dip(t, h, x, xn, ta, ua, v, p, mode, w):
    """The share of a step from x to xn at which a switching function may be beyond zero, or 0.

    A function that is on its side at both ends can have passed zero twice in between: the cubic
    through both ends' values and rates tells.
    """
    look_at(t + h, xn, ta, ua, v, p, mode, w)
    returning = False
    for k in range(K):
        w.ge[k], w.Ge[k] = w.g[k], w.G[k]
        returning = returning or mode[k] * w.G[k] > 0.0
    if not returning:
        return 0.0
    look_at(t, x, ta, ua, v, p, mode, w)
    share = 0.0
    for k in range(K):
        first, last = mode[k] * w.g[k], mode[k] * w.ge[k]
        fall, rise = mode[k] * w.G[k] * h, mode[k] * w.Ge[k] * h
        if fall < 0.0 < rise:
            square = 3.0 * (last - first) - 2.0 * fall - rise
            cube = 2.0 * (first - last) + fall + rise
            root = math.sqrt(square * square - 3.0 * cube * fall)
            where = -fall / (square + root) if square > 0.0 else (root - square) / (3.0 * cube)
            lowest = first + where * (fall + where * (square + where * cube))
            if lowest < 0.0 and 0.0 < where < 1.0 and (share == 0.0 or where < share):
                share = where
    return share


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
        step(t, middle, x, w.S, ta, ua, v, w.still, p, mode, w.constant[:0], w, w.xn, w.Sn)
        value, k = margins(t + middle, w.xn, ta, ua, v, p, mode, w, phi)
        if value < 0.0:
            high, f_high, which = middle, value, k
        else:
            low, f_low = middle, value
    if which < 0:
        step(t, high, x, w.S, ta, ua, v, w.still, p, mode, w.constant[:0], w, w.xn, w.Sn)
        _, which = margins(t + high, w.xn, ta, ua, v, p, mode, w, phi)
    return high, which


@called
def cross(k, t, x, S, ta, ua, v, ud, p, mode, act, w):
    """End mode k at the point reached: pass, stick, or come loose."""
    input_at(t, ta, ua, v, w)
    for j in range(M):
        w.uc[j] = w.u[j]
    if mode[k] == 0.0:
        resolve(t, x, w.uc, v, p, mode, w)
        mode[k] = 1.0 if w.s[k] > 0.0 else -1.0
        return
    below, above = rates_beside(k, t, x, w.uc, v, p, mode, w)
    beyond = below if mode[k] > 0.0 else above
    new = 0.0 if mode[k] * beyond > 0.0 else -mode[k]
    leap(k, new, t, x, S, w.uc, v, ud, p, mode, act, w)


@called
def roughness(t, h, x, xn, ta, ua, v, p, mode, w):
    """How much one step (from x to xn) and two half steps differ, relative to the states.

    Between two switches a phase can be far shorter than the sub-steps, such as the touch of a
    stiff wall: halving the sub-steps would not show that it is integrated badly.
    """
    step(t, 0.5 * h, x, w.S, ta, ua, v, w.still, p, mode, w.constant[:0], w, w.before, w.Sn)
    step(t + 0.5 * h, 0.5 * h, w.before, w.S, ta, ua, v, w.still, p, mode, w.constant[:0], w,
         w.after, w.Sn)
    largest, worst = 0.0, 0.0
    for i in range(N):
        largest = max(largest, abs(x[i]), abs(xn[i]))
    for i in range(N):
        scale = max(abs(x[i]), abs(xn[i]), 1e-6 * largest)
        if scale > 0.0:
            difference = abs(w.after[i] - xn[i]) / scale
            worst = max(worst, difference) if math.isfinite(difference) else np.inf
    return worst


@called
def advance(t, h, x, S, ta, ua, v, ud, p, mode, act, w):
    """One sub-step of length h, in place, stopping at every switch inside it.

    A sub-step without a switch is one step; one with a switch is cut so that it is exact.
    """
    done, limit, events, careful, before = 0.0, h, 0, False, np.inf
    while done < h:
        rest = min(h - done, limit)
        last = done + rest >= h
        if not step(t + done, rest, x, w.S, ta, ua, v, w.still, p, mode, w.constant[:0], w, w.xn,
                    w.Sn):
            return 1
        part, which, redo = rest, -1, careful or len(act) > 0
        end, _ = margins(t + h if last else t + done + rest, w.xn, ta, ua, v, p, mode, w, w.phi)
        share = 0.0
        if end >= -1e-14:
            share = dip(t + done, rest, x, w.xn, ta, ua, v, p, mode, w)
        if end < -1e-14 or share > 0.0 or careful:
            careful = True
            now = roughness(t + done, rest, x, w.xn, ta, ua, v, p, mode, w)
            if now > 1e-9 and (now < 0.5 * before or now > 1e-3) and rest > 1e-4 * h:
                limit, before = 0.5 * rest, now
                continue
            # where halving does not help only rounding is left: a state at rest, say
            careful = now <= 1e-9
            limit, before = 2.0 * rest if careful else h, np.inf
        for i in range(N):
            if not math.isfinite(w.xn[i]):
                return 1
        if share > 0.0:
            redo, part = True, share * rest
            step(t + done, part, x, w.S, ta, ua, v, w.still, p, mode, w.constant[:0], w, w.xn, w.Sn)
            end, _ = margins(t + done + part, w.xn, ta, ua, v, p, mode, w, w.phi)
        if end < -1e-14:
            part, which = locate(t + done, part, x, ta, ua, v, p, mode, w, end)
            redo = True
        else:
            part = rest
        if redo and not step(t + done, part, x, S, ta, ua, v, ud, p, mode, act, w, w.xn, w.Sn):
            return 1
        for i in range(N):
            x[i] = w.xn[i]
            for a in range(len(act)):
                S[a, i] = w.Sn[a, i]
        done = h if last and which < 0 else done + part
        if which >= 0:
            cross(which, t + done, x, S, ta, ua, v, ud, p, mode, act, w)
            events += 1
            if events > 1000:
                return 2
    return 0
