@called
def put_signs(b, mode, slide):
    """Signs into their registers; those held at zero by d g/dt = G(s) = 0, which is linear in s.

    Returns whether any is; then d s/dθ is put as well, if `slide` says that derivatives are wanted.
    """
    K = b.sizes[4]
    first = 1 + b.sizes[0] + b.sizes[1] + b.sizes[2]
    held = 0
    for k in range(K):
        b.r[first + k] = mode[k]
        if mode[k] == 0.0:
            held += 1
        if slide:
            for a in range(b.d.shape[1]):
                b.d[first + k, a] = 0.0
    if held == 0:
        return False
    values(b, b.group[G_RATE])
    by_signs(b)
    matrix, right, again, change = b.matrix, b.right, b.again, b.change
    for k in range(K):
        right[k, 0] = 0.0
        for j in range(K):
            matrix[k, j] = 0.0
        matrix[k, k] = 1.0
        o = b.out[G_RATE, k]
        if mode[k] == 0.0:
            right[k, 0] = -b.r[o]
            for j in range(K):
                if mode[j] == 0.0:
                    matrix[k, j] = b.ds[o, j] if b.signed[o] else 0.0
    for k in range(K):
        for j in range(K):
            again[k, j] = matrix[k, j]
    solve_small(matrix, right)
    for k in range(K):
        if mode[k] == 0.0:
            b.r[first + k] = right[k, 0]
    if not slide:
        return True
    # now that the signs are known: dG = 0 holds them as parameters vary
    values(b, b.group[G_RATE])
    tangents(b, b.group[G_RATE])
    for k in range(K):
        o = b.out[G_RATE, k]
        for a in range(b.d.shape[1]):
            change[k, a] = 0.0
        if mode[k] == 0.0 and b.live[o]:
            for a in range(b.d.shape[1]):
                change[k, a] = -b.d[o, a]
    solve_small(again, change)
    for k in range(K):
        if mode[k] == 0.0:
            for a in range(b.d.shape[1]):
                b.d[first + k, a] = change[k, a]
    return True


@called
def take_step(b, t, h, x, S, u, v, gap, dtau, delayed, mode, slopes_on, kx, kS, xs, Ss, xn, Sn):
    """One Runge-Kutta step of length h in the present modes; `gap` after the stop of u, v."""
    n, A = b.sizes[0], S.shape[1]
    r, d, live, out = b.r, b.d, b.live, b.out[F]
    put_rates(b, v)
    for stage in range(4):
        c = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
        for i in range(n):
            xs[i] = x[i] if stage == 0 else x[i] + c * kx[stage - 1, i]
        put(b, t + c, xs, u, v, gap + c)
        if slopes_on:
            for i in range(n):
                for a in range(A):
                    Ss[i, a] = S[i, a] if stage == 0 else S[i, a] + c * kS[stage - 1, i, a]
            put_tangents(b, Ss, v, dtau, delayed)
        put_signs(b, mode, slopes_on)
        values(b, b.group[F])
        if slopes_on:
            tangents(b, b.group[F])
        for i in range(n):
            o = out[i]
            kx[stage, i] = r[o]
            if slopes_on:
                for a in range(A):
                    kS[stage, i, a] = d[o, a] if live[o] else 0.0
    for i in range(n):
        xn[i] = x[i] + h / 6.0 * (kx[0, i] + 2.0 * kx[1, i] + 2.0 * kx[2, i] + kx[3, i])
        if slopes_on:
            for a in range(A):
                Sn[i, a] = S[i, a] + h / 6.0 * (
                    kS[0, i, a] + 2.0 * kS[1, i, a] + 2.0 * kS[2, i, a] + kS[3, i, a])


@called
def margin(b, t, x, u, v, gap, mode):
    """How far the modes are from their ends (>= 0 while they hold), and which is the closest."""
    K = b.sizes[4]
    first = 1 + b.sizes[0] + b.sizes[1] + b.sizes[2]
    put(b, t, x, u, v, gap)
    put_rates(b, v)
    put_signs(b, mode, b.flag[0])
    values(b, b.group[G])
    least, which = np.inf, -1
    for k in range(K):
        room = (1.0 - abs(b.r[first + k]) if mode[k] == 0.0
                else mode[k] * b.r[b.out[G, k]])
        if room < least:
            least, which = room, k
    return least, which


@called
def rate_of(b, k, mode):
    """d g_k/dt at what is put, in the given modes."""
    put_signs(b, mode, b.flag[0])
    values(b, b.group[G_RATE])
    return b.r[b.out[G_RATE, k]]


@called
def settled(b, k, mode):
    """The mode of a switching function that is at zero: the flow beside its surface decides."""
    kept = mode[k]
    mode[k] = -1.0
    below = rate_of(b, k, mode)
    mode[k] = 1.0
    above = rate_of(b, k, mode)
    mode[k] = kept
    if above < 0.0 < below:
        return 0.0
    if above == 0.0 and below == 0.0:
        return 1.0 if kept == 0.0 else kept
    return 1.0 if above + below > 0.0 else -1.0


@called
def passed(b, k, t, x, S, u, v, gap, dtau, delayed, mode, before):
    """End mode k at the point reached: pass, stick, or come loose; derivatives jump.

    S+ = S- + (f- - f+) dt_e with dt_e = -(∂g)/(dg/dt)- (Di Bernardo et al., 2008, sec. 2.5).
    """
    n, A, out = b.sizes[0], S.shape[1], b.out[F]
    put(b, t, x, u, v, gap)
    put_rates(b, v)
    if mode[k] == 0.0:
        put_signs(b, mode, b.flag[0])
        first = 1 + b.sizes[0] + b.sizes[1] + b.sizes[2]
        mode[k] = 1.0 if b.r[first + k] > 0.0 else -1.0
        return
    rate = rate_of(b, k, mode)
    values(b, b.group[F])
    for i in range(n):
        before[i] = b.r[out[i]]
    new = settled(b, k, mode)
    mode[k] = -mode[k] if new == mode[k] else new
    if A == 0 or rate == 0.0:
        return
    put_tangents(b, S, v, dtau, delayed)
    put_signs(b, mode, b.flag[1])
    values(b, b.group[G])
    tangents(b, b.group[G])
    values(b, b.group[F])
    o = b.out[G, k]
    for a in range(A):
        when = -(b.d[o, a] if b.live[o] else 0.0) / rate
        for i in range(n):
            S[i, a] += (before[i] - b.r[out[i]]) * when


@called
def begin(b, t, x, u, v, mode):
    """Choose the modes after inputs have changed."""
    put(b, t, x, u, v, 0.0)
    put_rates(b, v)
    for k in range(b.sizes[4]):
        values(b, b.group[G])
        g = b.r[b.out[G, k]]
        if abs(g) > 1e-9 and mode[k] != 0.0:
            mode[k] = 1.0 if g > 0.0 else -1.0
        else:
            mode[k] = settled(b, k, mode)


@called
def next_share(a, at_a, b, at_b, c, at_c):
    """How far from a to b a zero between them is guessed, the last guesses being a and c.

    Inverse quadratic interpolation where that is safe, else half-way (T. R. Chandrupatla, Advances
    in Engineering Software 28, 1997).
    """
    if at_a in (at_b, at_c) or at_b in (at_c, 0.0) or c == b:
        return 0.5
    place, value = (a - b) / (c - b), (at_a - at_b) / (at_c - at_b)
    if not (value * value < place and (1.0 - value) * (1.0 - value) < 1.0 - place):
        return 0.5
    return (at_a / (at_b - at_a) * at_c / (at_b - at_c)
            + (c - a) / (b - a) * at_a / (at_c - at_a) * at_b / (at_c - at_b))


@called
def run_tape(b, T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, p, act, first, output, row,
             inside, X, Y, J, x, S, xs, Ss, xn, Sn, kx, kS, before, mode):
    """The classical Runge-Kutta method, stopping where the right-hand side jumps; see `run`."""
    n, A, L, out = b.sizes[0], len(act), len(T), b.out[F]
    all_events = 0
    prepare(b, p, act, delayed)
    for q in range(L):
        u, v = U[q], V[q]
        if jumps[q]:
            if delayed and q > 0 and A > 0:
                put(b, T[q], x, U[q - 1], V[q - 1], T[q] - T[q - 1])
                put_rates(b, V[q - 1])
                put_signs(b, mode, b.flag[0])
                for j in range(b.sizes[1]):
                    values(b, b.group[F])
                    for i in range(n):
                        before[i] = b.r[out[i]]
                    b.r[1 + n + j] = U[q, j]
                    put_signs(b, mode, b.flag[0])
                    values(b, b.group[F])
                    for i in range(n):
                        for a in range(A):
                            S[i, a] += (before[i] - b.r[out[i]]) * dtau_in[j, a]
            begin(b, T[q], x, u, v, mode)
        if first[q] < first[q + 1]:
            put(b, T[q], x, u, v, 0.0)
            put_rates(b, v)
            put_tangents(b, S, v, dtau_in, delayed)
            put_signs(b, mode, b.flag[1])
            show(b, q, x, S, U, V, T, first, output, row, inside, dtau_in, dtau_out, delayed, Y, J)
        if X.shape[0] > 0:
            for i in range(n):
                X[q, i] = x[i]
        if q == L - 1:
            break
        h = (T[q + 1] - T[q]) / pieces[q]
        for piece in range(pieces[q]):
            done, events = piece * h, 0
            goal = (piece + 1) * h
            while done < goal:
                part = goal - done
                take_step(b, T[q] + done, part, x, S, u, v, done, dtau_in, delayed, mode, b.flag[1],
                          kx, kS, xs, Ss, xn, Sn)
                end, which = margin(b, T[q] + goal, xn, u, v, goal, mode)
                crossing = end < -1e-13
                if crossing:
                    low, high, at_low, at_high = 0.0, part, 0.0, end
                    if done == 0.0:
                        # behind another event one function is at zero, up to rounding
                        at_low, _ = margin(b, T[q], x, u, v, done, mode)
                    latest, at_latest, other, at_other = high, at_high, low, at_low
                    share = at_high / (at_high - at_low) if at_low > 0.0 else 0.5
                    for _ in range(60):
                        least = 0.5e-13 * part / (high - low)
                        if least > 0.5:
                            break
                        middle = latest + min(max(share, least), 1.0 - least) * (other - latest)
                        take_step(b, T[q] + done, middle, x, S, u, v, done, dtau_in, delayed, mode,
                                  b.flag[0], kx, kS, xs, Ss, xn, Sn)
                        room, k = margin(b, T[q] + done + middle, xn, u, v, done + middle, mode)
                        third, at_third = latest, at_latest
                        if (room < 0.0) != (at_latest < 0.0):
                            third, at_third, other, at_other = other, at_other, latest, at_latest
                        latest, at_latest = middle, room
                        if room < 0.0:
                            high, which = middle, k
                        else:
                            low = middle
                        share = next_share(latest, at_latest, other, at_other, third, at_third)
                    part = high
                    take_step(b, T[q] + done, part, x, S, u, v, done, dtau_in, delayed, mode,
                              b.flag[1], kx, kS, xs, Ss, xn, Sn)
                for i in range(n):
                    x[i] = xn[i]
                    if not abs(x[i]) < 1e120:
                        return 1, q
                    for a in range(A):
                        S[i, a] = Sn[i, a]
                if crossing:
                    done += part
                    passed(b, which, T[q] + done, x, S, u, v, done, dtau_in, delayed, mode, before)
                    events += 1
                    all_events += 1
                    if events > 1000 or all_events > L + 200:
                        return 2, q
                else:
                    done = goal
    return 0, L - 1


@njit(cache=True, error_model="numpy", nogil=True)
def integrate_tape(b, T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, x0, S0, p, act, first,
                   output, row, inside, X, Y, J):
    """`run_tape` with its scratch; the only function that Python calls."""
    n, A, x, S = b.sizes[0], len(act), x0.copy(), S0.T.copy()
    return run_tape(
        b, T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, p, act, first, output, row, inside,
        X, Y, J, x, S, x.copy(), S.copy(), x.copy(), S.copy(), np.empty((4, n)),
        np.empty((4, n, A)), np.empty(n), np.ones(b.sizes[4]))
