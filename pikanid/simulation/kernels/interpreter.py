@called
def compute(code, first, last, r):
    """Run operations on the registers' values."""
    for k in range(first, last):
        op, i, j, o = code[k, 0], code[k, 1], code[k, 2], code[k, 3]
        x = r[i]
        if op == ADD:
            r[o] = x + r[j]
        elif op == MUL:
            r[o] = x * r[j]
        elif op == DIV:
            r[o] = x / r[j]
        elif op == SQUARE:
            r[o] = x * x
        elif op == NEGATE:
            r[o] = -x
        elif op == SIN:
            r[o] = math.sin(x)
        elif op == COS:
            r[o] = math.cos(x)
        elif op == POSITIVE_POWER:
            r[o] = positive_power(x, r[j])
        elif op == POWER:
            r[o] = x ** r[j]
        elif op == TAN:
            r[o] = math.tan(x)
        elif op == EXP:
            r[o] = math.exp(x)
        elif op == LOG:
            r[o] = math.log(x) if x > 0.0 else np.nan
        elif op == SQRT:
            r[o] = math.sqrt(x) if x >= 0.0 else np.nan
        elif op == TANH:
            r[o] = math.tanh(x)
        elif op == SINH:
            r[o] = math.sinh(x)
        elif op == COSH:
            r[o] = math.cosh(x)
        elif op == ATAN:
            r[o] = math.atan(x)
        elif op == ASIN:
            r[o] = math.asin(x) if abs(x) <= 1.0 else np.nan
        elif op == ACOS:
            r[o] = math.acos(x) if abs(x) <= 1.0 else np.nan
        elif op == ATAN2:
            r[o] = math.atan2(x, r[j])
        elif op == LOG_ABS:
            r[o] = log_abs(x)
        elif op == SGN:
            r[o] = sgn(x)


@called
def slopes(op, x, y, value):
    """The partial derivatives of an operation by its arguments x and y."""
    if op == DIV:
        return 1.0 / y, -value / y
    if op == SQUARE:
        return 2.0 * x, 0.0
    if op == SIN:
        return math.cos(x), 0.0
    if op == COS:
        return -math.sin(x), 0.0
    if op == POSITIVE_POWER:
        return power_slope(x, y), value * log_abs(x)
    if op == POWER:
        return y * x ** (y - 1.0), value * (math.log(x) if x > 0.0 else 0.0)
    if op == TAN:
        return 1.0 + value * value, 0.0
    if op == EXP:
        return value, 0.0
    if op == LOG:
        return 1.0 / x, 0.0
    if op == SQRT:
        return 0.5 / value, 0.0
    if op == TANH:
        return 1.0 - value * value, 0.0
    if op == SINH:
        return math.cosh(x), 0.0
    if op == COSH:
        return math.sinh(x), 0.0
    if op == ATAN:
        return 1.0 / (1.0 + x * x), 0.0
    if op == ASIN:
        return 1.0 / math.sqrt(1.0 - x * x), 0.0
    if op == ACOS:
        return -1.0 / math.sqrt(1.0 - x * x), 0.0
    if op == ATAN2:
        return y / (x * x + y * y), -x / (x * x + y * y)
    if op == LOG_ABS:
        return 1.0 / x, 0.0
    return 0.0, 0.0


@called
def differentiate(code, first, last, r, d, live):
    """Carry derivatives d (registers, lanes) through operations whose values are computed.

    `live` marks the registers whose derivatives are not all zero.
    """
    lanes = d.shape[1]
    for k in range(first, last):
        op, i, j, o = code[k, 0], code[k, 1], code[k, 2], code[k, 3]
        if not live[o]:
            continue
        if op == ADD:
            if live[i] and live[j]:
                for a in range(lanes):
                    d[o, a] = d[i, a] + d[j, a]
            else:
                source = i if live[i] else j
                for a in range(lanes):
                    d[o, a] = d[source, a]
        elif op == MUL:
            x, y = r[i], r[j]
            if live[i] and live[j]:
                for a in range(lanes):
                    d[o, a] = d[i, a] * y + d[j, a] * x
            elif live[i]:
                for a in range(lanes):
                    d[o, a] = d[i, a] * y
            else:
                for a in range(lanes):
                    d[o, a] = d[j, a] * x
        elif op == NEGATE:
            for a in range(lanes):
                d[o, a] = -d[i, a]
        else:
            by_x, by_y = slopes(op, r[i], r[j], r[o])
            if live[i]:
                for a in range(lanes):
                    d[o, a] = d[i, a] * by_x
            else:
                for a in range(lanes):
                    d[o, a] = 0.0
            if two_arguments(op) and live[j]:
                for a in range(lanes):
                    d[o, a] += d[j, a] * by_y


@called
def two_arguments(op):
    return op in (ADD, MUL, DIV, POSITIVE_POWER, POWER, ATAN2)


@called
def spread(code, live):
    """Mark the results of operations with a live argument."""
    for k in range(len(code)):
        op, i, j, o = code[k, 0], code[k, 1], code[k, 2], code[k, 3]
        live[o] = op != SGN and (live[i] or (two_arguments(op) and live[j]))


@called
def put(b, t, x, u, v, h):
    """Time, states and inputs u + v h into their registers."""
    r, n = b.r, b.sizes[0]
    r[0] = t
    for i in range(n):
        r[1 + i] = x[i]
    for j in range(b.sizes[1]):
        r[1 + n + j] = u[j] + v[j] * h


@called
def put_tangents(b, S, v, dtau, delayed):
    """Derivatives of states (n, A), and of delayed inputs."""
    d, n = b.d, b.sizes[0]
    for i in range(n):
        for a in range(S.shape[1]):
            d[1 + i, a] = S[i, a]
    if delayed:
        for j in range(b.sizes[1]):
            for a in range(S.shape[1]):
                d[1 + n + j, a] = -v[j] * dtau[j, a]


@called
def put_rates(b, v):
    first = 1 + b.sizes[0] + b.sizes[1] + b.sizes[2] + b.sizes[4]
    for j in range(b.sizes[1]):
        b.r[first + j] = v[j]


@called
def values(b, group):
    if b.native[0, group] != 0:
        call_native(b.native[0, group], b.r, b.d)
    else:
        compute(b.code, b.span[group, 0], b.span[group, 1], b.r)


@called
def tangents(b, group):
    if b.native[1, group] != 0:
        call_native(b.native[1, group], b.r, b.d)
    elif b.d.shape[1] > 0:
        differentiate(b.code, b.span[group, 0], b.span[group, 1], b.r, b.d, b.live)


@called
def by_signs(b):
    """Derivatives of the switching functions' rates by the signs."""
    if b.native[2, G_RATE] != 0:
        call_native(b.native[2, G_RATE], b.r, b.ds)
    else:
        differentiate(b.code, b.span[G_RATE, 0], b.span[G_RATE, 1], b.r, b.ds, b.signed)


@called
def show(b, q, x, S, U, V, T, first, output, row, inside, dtau_in, dtau_out, delayed, Y, J):
    """Write the observations that belong to the q-th stop; signs are put."""
    A = S.shape[1]
    if b.native[AROUND_TANGENTS, H] != 0:
        call_look(b.native[AROUND_TANGENTS, H], b.r, b.d, T[q], 0.0, x, S, U[q], V[q], dtau_in)
    else:
        put(b, T[q], x, U[q], V[q], 0.0)
        put_tangents(b, S, V[q], dtau_in, delayed)
        values(b, b.group[H])
        tangents(b, b.group[H])
    for k in range(first[q], first[q + 1]):
        o = b.out[H, output[k]]
        Y[row[k]] = b.r[o]
        for a in range(A):
            J[row[k], a] = b.d[o, a] if b.live[o] else 0.0
    if delayed:
        put_rates(b, V[q])
        values(b, b.group[H_RATE])
        for k in range(first[q], first[q + 1]):
            if inside[k]:
                rate = b.r[b.out[H_RATE, output[k]]]
                for a in range(A):
                    J[row[k], a] -= rate * dtau_out[output[k], a]


@called
def prepare(b, p, act, moving_inputs):
    """Set parameters and their derivatives; mark what is live; run the prelude."""
    n, m, P, K = b.sizes[0], b.sizes[1], b.sizes[2], b.sizes[4]
    first = 1 + n + m
    for i in range(len(b.live)):
        b.live[i] = b.signed[i] = False
        for a in range(len(act)):
            b.d[i, a] = 0.0
        for k in range(K):
            b.ds[i, k] = 0.0
    for i in range(n):
        b.live[1 + i] = True
    for j in range(m):
        b.live[1 + n + j] = moving_inputs
    for k in range(P):
        b.r[first + k] = p[k]
    for a in range(len(act)):
        if act[a] < P:
            b.live[first + act[a]] = True
            b.d[first + act[a], a] = 1.0
    for k in range(K):
        b.live[first + P + k] = True
        b.signed[first + P + k] = True
        b.ds[first + P + k, k] = 1.0
    values(b, b.group[PRELUDE])
    spread(b.code, b.live)
    spread(b.code, b.signed)
    tangents(b, b.group[PRELUDE])
