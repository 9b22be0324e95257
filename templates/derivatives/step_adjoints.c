/* Adjoints of a run: back through its linearised steps.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models.
 */

/* Adjoints through the steps, from the last to the first. state, in and out, (4 nv + 3 nz, directions): derivatives of
 * the functionals in q, v, vdot, a, z, zdot, r at the end of the last step, without their direct part of that
 * row; then at the start of the first. direct, of each step, (3 nv + nz + nl, directions): the direct part of
 * functionals at the row of its end. gradient: (np, directions), to which the derivatives in parameters are added.
 * multipliers: of the equations of each step, (rows, directions). ends, of each step, (2 nv, directions): derivatives
 * in q' and in D. sources, of each step, (2 nv + nh, directions), or NULL: additions to the derivatives in q at its start, in
 * h D and in eta, if these are differentiated once more. Returns as tangents do. */
EG_SEEN long eomgen_step_adjoints(const eg_steps *given, const double *direct, const double *sources, double *state,
    double *gradient, double *multipliers, double *ends, double *room, long *pivot)
{
    const long nv = given->nv, nz = given->nz, nl = given->nl, nh = given->nh, np = given->np;
    const long n = nv + nz + nh + nl, count = given->directions, block = nv * count, small = nz * count;
    const long turning = eg_turning(given), shared = nh ? np - nv : 0;
    const eg_gains g = eg_gains_of(given->coefficients);
    eg_factors f;
    double *D = eg_begin(given, &g, room, pivot, &f), *temporary = D + block, *solved = temporary + 6 * count;
    double *q = state, *v = q + block, *vdot = v + block, *a = vdot + block, *z = a + block, *zdot = z + small,
        *r = zdot + small;
    const long row_of[4] = { 0, nv, nv + nz, nv + nz + nh };
    const int in_q[4] = { EG_RQ, EG_FQ, EG_HQ, EG_ZQ }, in_v[4] = { EG_RV, EG_FV, -1, EG_ZV },
        in_p[4] = { EG_RP, EG_FP, EG_HP, EG_ZP };
    long k, group;
    for (k = given->steps - 1; k >= 0; --k) {
        const int lane = (int)(k % EG_LANES);
        const double *A = given->A + k * turning, *T = given->T + k * turning, *values = f.values + lane;
        const double *own = direct + k * (3 * nv + nz + nl) * count;
        const double *source = sources ? sources + k * (2 * nv + nh) * count : sources;
        double *x = multipliers + k * n * count;
        long i;
        if ((lane == EG_LANES - 1 || k == given->steps - 1) && !eg_factor_steps(given, k - lane, &f))
            return -1 - k;
        eg_add_scaled(q, 1.0, own, 3 * block);
        eg_add_scaled(z, 1.0, own + 3 * block, small);
        /* of the unknowns */
        memcpy(D, q, (size_t)block * sizeof *D);
        eg_turn(given, T, 1, D, count, temporary);
        if (source)
            eg_add_scaled(D, 1.0, source + block, block);
        memset(x, 0, (size_t)(n * count) * sizeof *x);
        for (i = 0; i < block; ++i)
            x[i] = a[i] + g.h * g.gamma * v[i] + g.to_vdot * vdot[i] + g.h * g.h * g.beta * D[i];
        memcpy(x + block, own + 3 * block + small, (size_t)(nl * count) * sizeof *x);
        if (nh)
            eg_add_block(f.plan, EG_G, values, -g.h, D, x + (nv + nl) * count, count);
        if (nh && source)
            eg_add_scaled(x + (nv + nl) * count, 1.0, source + 2 * block, nh * count);
        for (i = 0; i < small; ++i)
            x[(nv + nl + nh) * count + i] = r[i] + g.h * g.zgamma * z[i] + g.to_zdot * zdot[i];
        if (!eg_solve_step(&f, lane, 1, n, x, count, solved))
            return k;
        /* of the part that the unknowns do not change */
        for (group = 0; group < 4; ++group) {
            const double *rows = x + row_of[group] * count;
            eg_add_block_transposed(f.plan, in_q[group], values, -1.0, rows, q, count);
            if (in_v[group] >= 0)
                eg_add_block_transposed(f.plan, in_v[group], values, -1.0, rows, v, count);
            eg_add_block_transposed(f.plan, in_p[group], values, -1.0, rows, gradient, count);
        }
        eg_add_block_transposed(f.plan, EG_M, values, -1.0, x, vdot, count);
        eg_add_block_transposed(f.plan, EG_RZ, values, -1.0, x, z, count);
        eg_add_block_transposed(f.plan, EG_FZ, values, -1.0, x + block, z, count);
        eg_add_scaled(zdot, -1.0, x + block, small);
        /* of the start of the step */
        memcpy(D, q, (size_t)block * sizeof *D);
        memcpy(ends + 2 * k * block, q, (size_t)block * sizeof *ends);
        eg_turn(given, T, 1, D, count, temporary);
        if (source)
            eg_add_scaled(D, 1.0, source + block, block);
        for (i = 0; i < block; ++i)
            D[i] *= g.h;
        memcpy(ends + (2 * k + 1) * block, D, (size_t)block * sizeof *ends);
        eg_turn(given, A, 1, q, count, temporary);
        if (source)
            eg_add_scaled(q, 1.0, source, block);
        if (nh) {
            eg_add_block_transposed(f.plan, EG_N, values, -1.0, D, q, count);
            eg_add_block_transposed(f.plan, EG_NP, values, -1.0, D, gradient, count);
            eg_add_diagonal(f.plan, values, -1.0, D, gradient + shared * count, count);
        }
        for (i = 0; i < block; ++i) {
            a[i] = g.am / (1.0 - g.af) * vdot[i] + g.h * (1.0 - g.gamma) * v[i] + g.h * (0.5 - g.beta) * D[i];
            vdot[i] = -g.af / (1.0 - g.af) * vdot[i];
            v[i] += D[i];
        }
        for (i = 0; i < small; ++i) {
            r[i] = g.h * (1.0 - g.zgamma) * z[i] + g.zam / (1.0 - g.af) * zdot[i];
            zdot[i] = -g.af / (1.0 - g.af) * zdot[i];
        }
    }
    return given->steps;
}
