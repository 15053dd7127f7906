@inlined
def fixed_step(b, t, h, x, S, u, v, gap, dtau, mode, w, xn, Sn):
    """`take_step` where no sign is held, without a call that hands over the whole tape."""
    sign = 1 + b.sizes[0] + b.sizes[1] + b.sizes[2]
    for k in range(len(mode)):
        b.r[sign + k] = mode[k]
        for a in range(S.shape[1]):
            b.d[sign + k, a] = 0.0
    call_step(b.code[STEP_TANGENTS], b.r, b.d, t, gap, x, S, u, v, dtau, h, xn, Sn)


@called
def take_step(b, t, h, x, S, u, v, gap, dtau, mode, slopes_on, w, xn, Sn):
    """One Runge-Kutta step of length h in the present modes; `gap` after the stop of u, v."""
    n, A = b.sizes[0], S.shape[1]
    r, d, out, code = b.r, b.d, b.out, b.code
    kx, kS, xs, Ss = w.kx, w.kS, w.x, w.S
    if fixed(mode):
        put_signs(b, mode, slopes_on)
        call_step(code[STEP_TANGENTS if slopes_on else STEP], r, d, t, gap, x, S, u, v, dtau, h,
                  xn, Sn)
        return
    # signs that are held at zero change from stage to stage
    for stage in range(4):
        c = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
        for i in range(n):
            xs[i] = x[i] if stage == 0 else x[i] + c * kx[stage - 1, i]
        if slopes_on:
            for i in range(n):
                for a in range(A):
                    Ss[i, a] = S[i, a] if stage == 0 else S[i, a] + c * kS[stage - 1, i, a]
        call_look(code[PUT_TANGENTS if slopes_on else PUT], r, d, t + c, gap + c, xs, Ss, u, v,
                  dtau)
        put_signs(b, mode, slopes_on)
        call_native(code[VALUES_F], r, d)
        if slopes_on:
            call_native(code[TANGENTS_F], r, d)
        for i in range(n):
            kx[stage, i] = r[out[F, i]]
            if slopes_on:
                for a in range(A):
                    kS[stage, i, a] = d[out[F, i], a]
    for i in range(n):
        xn[i] = x[i] + h / 6.0 * (kx[0, i] + 2.0 * kx[1, i] + 2.0 * kx[2, i] + kx[3, i])
        if slopes_on:
            for a in range(A):
                Sn[i, a] = S[i, a] + h / 6.0 * (
                    kS[0, i, a] + 2.0 * kS[1, i, a] + 2.0 * kS[2, i, a] + kS[3, i, a])


@cached_jit(error_model="numpy")
def stages(b, x, S):
    """Scratch for a step."""
    return Stages(np.empty((4, len(x))), np.empty((4, *S.shape)), x.copy(), S.copy())
