@called
def margin(b, t, x, S, u, v, gap, dtau, mode):
    """How far the modes are from their ends (>= 0 while they hold), and which is the closest."""
    first = 1 + b.sizes[0] + b.sizes[1] + b.sizes[2]
    if not fixed(mode):  # else the step that led here has put them
        call_look(b.code[PUT], b.r, b.d, t, gap, x, S, u, v, dtau)
        put_signs(b, mode, b.flag[0])
    call_look(b.code[LOOK_G], b.r, b.d, t, gap, x, S, u, v, dtau)
    least, which = np.inf, -1
    for k in range(len(mode)):
        room = (1.0 - abs(b.r[first + k]) if mode[k] == 0.0
                else mode[k] * b.r[b.out[G, k]])
        if room < least:
            least, which = room, k
    return least, which


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
def cross(b, stop, part, x, S, u, v, done, dtau, mode, end, which, w, xn, Sn):
    """The step, of at most `part` after `done`, to where the first mode ends; and which that is.

    `end` and `which` are the margin behind the whole step, below zero.
    """
    low, high, at_low, at_high = 0.0, part, 0.0, end
    if done == 0.0:
        # behind another event one function is at zero, up to rounding
        at_low, _ = margin(b, stop, x, S, u, v, done, dtau, mode)
    latest, at_latest, other, at_other = high, at_high, low, at_low
    share = at_high / (at_high - at_low) if at_low > 0.0 else 0.5
    for _ in range(60):
        least = 0.5e-13 * part / (high - low)
        if least > 0.5:
            break
        middle = latest + min(max(share, least), 1.0 - least) * (other - latest)
        take_step(b, stop + done, middle, x, S, u, v, done, dtau, mode, b.flag[0],
                  w, xn, Sn)
        room, k = margin(b, stop + done + middle, xn, S, u, v, done + middle, dtau, mode)
        third, at_third = latest, at_latest
        if (room < 0.0) != (at_latest < 0.0):
            third, at_third, other, at_other = other, at_other, latest, at_latest
        latest, at_latest = middle, room
        if room < 0.0:
            high, which = middle, k
        else:
            low = middle
        share = next_share(latest, at_latest, other, at_other, third, at_third)
    take_step(b, stop + done, high, x, S, u, v, done, dtau, mode, b.flag[1],
              w, xn, Sn)
    return high, which


@called
def switch_one_by_one(b, t, gap, x, S, u_old, v_old, u, v, dtau, mode, before, held, rates):
    """Inputs go to u, v one after the other, each with the modes that it finds and leaves: one that
    comes later by dtau moves the state by (f- - f+) dtau.
    """
    n, m, A, r, code = b.sizes[0], b.sizes[1], S.shape[1], b.r, b.code
    for j in range(m):
        held[j], rates[j] = u_old[j] + v_old[j] * gap, v_old[j]
    for j in range(m):
        call_look(code[PUT], r, b.d, t, 0.0, x, S, held, rates, dtau)
        put_signs(b, mode, b.flag[0])
        call_native(code[VALUES_F], r, b.d)
        for i in range(n):
            before[i] = r[b.out[F, i]]
        held[j], rates[j] = u[j], v[j]
        begin(b, t, x, S, held, rates, dtau, mode)
        call_look(code[PUT], r, b.d, t, 0.0, x, S, held, rates, dtau)
        put_signs(b, mode, b.flag[0])
        call_native(code[VALUES_F], r, b.d)
        for i in range(n):
            for a in range(A):
                S[i, a] += (before[i] - r[b.out[F, i]]) * dtau[j, a]


@called
def run_tape(b, T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, p, first, output, row, inside,
             X, Y, J, x, S, w, xn, Sn, before, mode, held, rates):
    """Step after step, stopping where the right-hand side jumps; see `run` for the arguments."""
    n, A, L, K = b.sizes[0], S.shape[1], len(T), b.sizes[4]
    r, d, out, code = b.r, b.d, b.out, b.code
    all_events = 0
    prepare(b, p)
    for q in range(L):
        u, v = U[q], V[q]
        if jumps[q]:
            if delayed and q > 0 and A > 0:
                switch_one_by_one(b, T[q], T[q] - T[q - 1], x, S, U[q - 1], V[q - 1], u, v,
                                  dtau_in, mode, before, held, rates)
            clear = fixed(mode)
            if clear:
                call_look(code[LOOK_G], r, d, T[q], 0.0, x, S, u, v, dtau_in)
                for k in range(K):
                    clear = clear and abs(r[out[G, k]]) > 1e-9
            if clear:
                for k in range(K):
                    mode[k] = 1.0 if r[out[G, k]] > 0.0 else -1.0
            else:
                begin(b, T[q], x, S, u, v, dtau_in, mode)
        if first[q] < first[q + 1]:
            if not fixed(mode):
                call_look(code[PUT_TANGENTS], r, d, T[q], 0.0, x, S, u, v, dtau_in)
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
                if fixed(mode):
                    fixed_step(b, T[q] + done, part, x, S, u, v, done, dtau_in, mode, w, xn, Sn)
                    call_look(code[LOOK_G], r, d, T[q] + goal, goal, xn, S, u, v, dtau_in)
                    end, which = np.inf, -1
                    for k in range(K):
                        room = mode[k] * r[out[G, k]]
                        if room < end:
                            end, which = room, k
                else:
                    take_step(b, T[q] + done, part, x, S, u, v, done, dtau_in, mode, b.flag[1],
                              w, xn, Sn)
                    end, which = margin(b, T[q] + goal, xn, S, u, v, goal, dtau_in, mode)
                crossing = end < -1e-13
                if crossing:
                    part, which = cross(b, T[q], part, x, S, u, v, done, dtau_in, mode, end, which,
                                        w, xn, Sn)
                for i in range(n):
                    x[i] = xn[i]
                    if not abs(x[i]) < 1e120:
                        return 1, q
                    for a in range(A):
                        S[i, a] = Sn[i, a]
                if crossing:
                    done += part
                    passed(b, which, T[q] + done, x, S, u, v, done, dtau_in, mode, before)
                    events += 1
                    all_events += 1
                    if events > 1000 or all_events > L + 200:
                        return 2, q
                else:
                    done = goal
    return 0, L - 1


@cached_jit(error_model="numpy", nogil=True)
def integrate_tape(b, T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, x0, S0, p, first, output,
                   row, inside, X, Y, J):
    """`run_tape` with its scratch; the only function that Python calls."""
    n, x, S = b.sizes[0], x0.copy(), S0.T.copy()
    return run_tape(
        b, T, pieces, U, V, jumps, dtau_in, dtau_out, delayed, p, first, output, row, inside,
        X, Y, J, x, S, stages(b, x, S), x.copy(), S.copy(), np.empty(n), np.ones(b.sizes[4]),
        np.empty(b.sizes[1]), np.empty(b.sizes[1]))
