@called
def fixed(mode):
    """Whether no sign is held at zero: then all stay what they are during a step."""
    held = 0
    for k in range(len(mode)):
        if mode[k] == 0.0:
            held += 1
    return held == 0


@called
def put_signs(b, mode, slide):
    """Signs into their registers; those held at zero by d g/dt = G(s) = 0, which is linear in s.

    Then, if `slide` says that derivatives are wanted, d s/dθ is put as well.
    """
    r, d, ds, out = b.r, b.d, b.ds, b.out
    K, lanes = len(mode), d.shape[1]
    first = 1 + b.sizes[0] + b.sizes[1] + b.sizes[2]
    for k in range(K):
        r[first + k] = mode[k]
        if slide:
            for a in range(lanes):
                d[first + k, a] = 0.0
    if fixed(mode):
        return
    call_native(b.code[VALUES_G_RATE], r, d)
    call_native(b.code[SIGNS_G_RATE], r, ds)
    if K == 1:
        # as below, without matrices: what sticks is most often one dry friction
        o = out[G_RATE, 0]
        slope = ds[o, 0]
        r[first] = -r[o] / slope if slope != 0.0 else 0.0
        if slide:
            call_native(b.code[VALUES_G_RATE], r, d)
            call_native(b.code[TANGENTS_G_RATE], r, d)
            for a in range(lanes):
                d[first, a] = -d[o, a] / slope if slope != 0.0 else 0.0
        return
    matrix, right, again, change = b.matrix, b.right, b.again, b.change
    for k in range(K):
        right[k, 0] = 0.0
        for j in range(K):
            matrix[k, j] = 0.0
        matrix[k, k] = 1.0
        o = out[G_RATE, k]
        if mode[k] == 0.0:
            right[k, 0] = -r[o]
            for j in range(K):
                if mode[j] == 0.0:
                    matrix[k, j] = ds[o, j]
    for k in range(K):
        for j in range(K):
            again[k, j] = matrix[k, j]
    solve_small(matrix, right)
    for k in range(K):
        if mode[k] == 0.0:
            r[first + k] = right[k, 0]
    if not slide:
        return
    # now that the signs are known: dG = 0 holds them as parameters vary
    call_native(b.code[VALUES_G_RATE], r, d)
    call_native(b.code[TANGENTS_G_RATE], r, d)
    for k in range(K):
        o = out[G_RATE, k]
        for a in range(lanes):
            change[k, a] = -d[o, a] if mode[k] == 0.0 else 0.0
    solve_small(again, change)
    for k in range(K):
        if mode[k] == 0.0:
            for a in range(lanes):
                d[first + k, a] = change[k, a]


@called
def rate_of(b, k, mode):
    """d g_k/dt at what is put, in the given modes."""
    put_signs(b, mode, b.flag[0])
    call_native(b.code[VALUES_G_RATE], b.r, b.d)
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
def begin(b, t, x, S, u, v, dtau, mode):
    """Choose the modes after inputs have changed."""
    call_look(b.code[PUT], b.r, b.d, t, 0.0, x, S, u, v, dtau)
    for k in range(len(mode)):
        call_native(b.code[VALUES_G], b.r, b.d)
        g = b.r[b.out[G, k]]
        if abs(g) > 1e-9 and mode[k] != 0.0:
            mode[k] = 1.0 if g > 0.0 else -1.0
        else:
            mode[k] = settled(b, k, mode)


@called
def passed(b, k, t, x, S, u, v, gap, dtau, mode, before):
    """End mode k at the point reached: pass, stick, or come loose; derivatives jump.

    S+ = S- + (f- - f+) dt_e with dt_e = -(∂g)/(dg/dt)- (Di Bernardo et al., 2008, sec. 2.5).
    """
    n, A, r, d, code = b.sizes[0], S.shape[1], b.r, b.d, b.code
    call_look(code[PUT_TANGENTS], r, d, t, gap, x, S, u, v, dtau)
    if mode[k] == 0.0:
        put_signs(b, mode, b.flag[0])
        first = 1 + b.sizes[0] + b.sizes[1] + b.sizes[2]
        mode[k] = 1.0 if r[first + k] > 0.0 else -1.0
        return
    rate = rate_of(b, k, mode)
    call_native(code[VALUES_F], r, d)
    for i in range(n):
        before[i] = r[b.out[F, i]]
    new = settled(b, k, mode)
    mode[k] = -mode[k] if new == mode[k] else new
    if A == 0 or rate == 0.0:
        return
    put_signs(b, mode, b.flag[1])
    call_native(code[VALUES_G], r, d)
    call_native(code[TANGENTS_G], r, d)
    call_native(code[VALUES_F], r, d)
    o = b.out[G, k]
    for a in range(A):
        when = -d[o, a] / rate
        for i in range(n):
            S[i, a] += (before[i] - r[b.out[F, i]]) * when
