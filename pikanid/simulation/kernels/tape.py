@called
def show(b, q, x, S, U, V, T, first, output, row, inside, dtau_in, dtau_out, delayed, Y, J):
    """Write the observations that belong to the q-th stop; signs are put."""
    A = S.shape[1]
    call_look(b.code[LOOK_H], b.r, b.d, T[q], 0.0, x, S, U[q], V[q], dtau_in)
    for k in range(first[q], first[q + 1]):
        o = b.out[H, output[k]]
        Y[row[k]] = b.r[o]
        for a in range(A):
            J[row[k], a] = b.d[o, a]
    if delayed:
        call_native(b.code[VALUES_H_RATE], b.r, b.d)
        for k in range(first[q], first[q + 1]):
            if inside[k]:
                rate = b.r[b.out[H_RATE, output[k]]]
                for a in range(A):
                    J[row[k], a] -= rate * dtau_out[row[k], a]


@called
def prepare(b, p):
    """Set the parameters, and what depends on them alone."""
    first = 1 + b.sizes[0] + b.sizes[1]
    for k in range(b.sizes[2]):
        b.r[first + k] = p[k]
    call_native(b.code[VALUES_PRELUDE], b.r, b.d)
    call_native(b.code[TANGENTS_PRELUDE], b.r, b.d)
