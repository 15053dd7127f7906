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
def fixed(mode):
    """Whether no sign is held at zero: then all stay what they are during a step."""
    held = 0
    for k in range(len(mode)):
        if mode[k] == 0.0:
            held += 1
    return held == 0


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
