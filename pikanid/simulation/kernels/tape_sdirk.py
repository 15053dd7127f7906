@called
def slide_by_states(b, mode, w):
    """Derivatives by the states of the signs put into `w.dx`: dG = 0 holds them as states vary."""
    K, n = len(mode), b.sizes[0]
    first = 1 + n + b.sizes[1] + b.sizes[2]
    for k in range(K):
        for i in range(n):
            w.dx[first + k, i] = 0.0
    if fixed(mode):
        return
    call_native(b.code[VALUES_G_RATE], b.r, b.d)
    call_native(b.code[STATES_G_RATE], b.r, w.dx)
    for k in range(K):
        o, held = b.out[G_RATE, k], mode[k] == 0.0
        for j in range(K):
            b.matrix[k, j] = b.ds[o, j] if held and mode[j] == 0.0 else 1.0 if k == j else 0.0
        for i in range(n):
            w.slide[k, i] = -w.dx[o, i] if held else 0.0
    solve_small(b.matrix, w.slide)
    for k in range(K):
        if mode[k] == 0.0:
            for i in range(n):
                w.dx[first + k, i] = w.slide[k, i]


@called
def put_by_states(b, t, gap, x, S, u, v, dtau, mode, w):
    """What the right-hand side takes into the registers, its values and its ∂/∂x into `w.dx`."""
    call_look(b.code[PUT], b.r, b.d, t, gap, x, S, u, v, dtau)
    put_signs(b, mode, b.flag[0])
    slide_by_states(b, mode, w)
    call_native(b.code[VALUES_F], b.r, b.d)
    call_native(b.code[STATES_F], b.r, w.dx)


@called
def put_matrix(b, h, w):
    """I - h/4 ∂f/∂x into `w.matrix`; whether it is finite."""
    finite = True
    for i in range(b.sizes[0]):
        for j in range(b.sizes[0]):
            w.matrix[i, j] = (1.0 if i == j else 0.0) - 0.25 * h * w.dx[b.out[F, i], j]
            finite = finite and math.isfinite(w.matrix[i, j])
    return finite


@called
def solve_stage(b, stage, t, gap, h, S, u, v, dtau, mode, w):
    """The slope of a stage by Newton's method, from that of the one before; whether it is found."""
    n, slope = b.sizes[0], w.kx[stage]
    for _ in range(30):
        size, move = 0.0, 0.0
        for i in range(n):
            w.x[i] = w.start[i] + 0.25 * h * slope[i]
            size = max(size, abs(w.x[i]))
        put_by_states(b, t, gap, w.x, S, u, v, dtau, mode, w)
        if not put_matrix(b, h, w):
            return False
        for i in range(n):
            w.change[i, 0] = b.r[b.out[F, i]] - slope[i]
        solve_small(w.matrix, w.change)
        for i in range(n):
            slope[i] += w.change[i, 0]
            move = max(move, abs(w.change[i, 0]) * h)
        if not math.isfinite(move):
            return False
        if move <= 1e-13 * (1e-3 + size):
            return True
    return False


@called
def take_step(b, t, h, x, S, u, v, gap, dtau, mode, slopes_on, w, xn, Sn):
    """One step of the singly diagonally implicit Runge-Kutta method, `gap` after the stop of u, v.

    The stages' sensitivities satisfy linear equations with the same matrix I - h/4 ∂f/∂x as the
    last step of Newton's method.  Where a stage is not found the state behind the step is none.
    """
    n, A = b.sizes[0], S.shape[1]
    for i in range(n):
        xn[i] = np.nan
    for stage in range(5):
        ahead = NODES[stage] * h
        for i in range(n):
            w.start[i] = x[i]
            for j in range(stage):
                w.start[i] += h * SDIRK[stage, j] * w.kx[j, i]
            w.kx[stage, i] = w.kx[stage - 1, i] if stage > 0 else 0.0
        if not solve_stage(b, stage, t + ahead, gap + ahead, h, S, u, v, dtau, mode, w):
            return
        if slopes_on:
            for i in range(n):
                w.x[i] = w.start[i] + 0.25 * h * w.kx[stage, i]
                for a in range(A):
                    w.S[i, a] = S[i, a]
                    for j in range(stage):
                        w.S[i, a] += h * SDIRK[stage, j] * w.kS[j, i, a]
            put_by_states(b, t + ahead, gap + ahead, w.x, w.S, u, v, dtau, mode, w)
            call_look(b.code[PUT_TANGENTS], b.r, b.d, t + ahead, gap + ahead, w.x, w.S, u, v, dtau)
            put_signs(b, mode, slopes_on)
            call_native(b.code[VALUES_F], b.r, b.d)
            call_native(b.code[TANGENTS_F], b.r, b.d)
            put_matrix(b, h, w)
            for i in range(n):
                for a in range(A):
                    w.right[i, a] = b.d[b.out[F, i], a]
            solve_small(w.matrix, w.right)
            for i in range(n):
                for a in range(A):
                    w.kS[stage, i, a] = w.right[i, a]
    for i in range(n):
        xn[i] = x[i]
        for j in range(5):
            xn[i] += h * SDIRK[4, j] * w.kx[j, i]
        if slopes_on:
            for a in range(A):
                Sn[i, a] = S[i, a]
                for j in range(5):
                    Sn[i, a] += h * SDIRK[4, j] * w.kS[j, i, a]


@inlined
def fixed_step(b, t, h, x, S, u, v, gap, dtau, mode, w, xn, Sn):
    """`take_step` where no sign is held."""
    take_step(b, t, h, x, S, u, v, gap, dtau, mode, b.flag[1], w, xn, Sn)


@cached_jit(error_model="numpy")
def stages(b, x, S):
    """Scratch for a step."""
    n = len(x)
    dx = np.zeros((len(b.r), n))
    for i in range(n):
        dx[1 + i, i] = 1.0
    return Newton(np.empty((5, n)), np.empty((5, *S.shape)), x.copy(), S.copy(),
                  np.empty(n), dx, np.empty((n, n)), np.empty((n, 1)), S.copy(),
                  np.empty((b.sizes[4], n)))
