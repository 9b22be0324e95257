/* Tangents of a run: forward through its linearised steps.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models.
 */

/* Tangents through the steps. state, in and out, (4 nv + 3 nz, directions): dq, dv, dvdot, da, dz, dzdot, dr. dp: (np,
 * directions). record, of each step, (3 nv + nz + nl, directions): dq, dv, dvdot, dz, dlam at its end; eta, of each step,
 * (nh, directions). Returns the number of the first step whose matrix is singular, else the number of steps; -1 - k: the
 * plan lacks nonzeros of step k, at which all is ready to go on. */
EG_SEEN long eomgen_step_tangents(const eg_steps *given, const double *dp, double *state, double *record, double *eta,
    double *room, long *pivot)
{
    const long nv = given->nv, nz = given->nz, nl = given->nl, nh = given->nh, np = given->np;
    const long n = nv + nz + nh + nl, count = given->directions, block = nv * count, small = nz * count;
    const long turning = eg_turning(given), shared = nh ? np - nv : 0;
    const eg_gains g = eg_gains_of(given->coefficients);
    eg_factors f;
    double *x = eg_begin(given, &g, room, pivot, &f), *D = x + n * count, *temporary = D + block,
        *solved = temporary + 6 * count;
    double *q = state, *v = q + block, *vdot = v + block, *a = vdot + block, *z = a + block, *zdot = z + small,
        *r = zdot + small;
    const long row_of[4] = { 0, nv, nv + nz, nv + nz + nh };
    const int in_q[4] = { EG_RQ, EG_FQ, EG_HQ, EG_ZQ }, in_v[4] = { EG_RV, EG_FV, -1, EG_ZV },
        in_p[4] = { EG_RP, EG_FP, EG_HP, EG_ZP };
    long k, group;
    record += given->first * (3 * nv + nz + nl) * count;
    for (k = given->first; k < given->steps; ++k) {
        const int lane = (int)(k % EG_LANES);
        const double *A = given->A + k * turning, *T = given->T + k * turning, *own = f.values + lane;
        if (!lane && !eg_factor_steps(given, k, &f))
            return -1 - k;
        /* the part that the unknowns do not change */
        memcpy(D, v, (size_t)block * sizeof *D);
        eg_add_scaled(D, g.h * (0.5 - g.beta), a, block);
        if (nh) {
            eg_add_block(f.plan, EG_N, own, -1.0, q, D, count);
            eg_add_block(f.plan, EG_NP, own, -1.0, dp, D, count);
            eg_add_diagonal(f.plan, own, -1.0, dp + shared * count, D, count);
        }
        eg_turn(given, A, 0, q, count, temporary);
        eg_turn(given, T, 0, D, count, temporary);
        eg_add_scaled(q, g.h, D, block);
        eg_add_scaled(v, g.h * (1.0 - g.gamma), a, block);
        eg_multiply(vdot, -g.af / (1.0 - g.af), block);
        eg_add_scaled(vdot, g.am / (1.0 - g.af), a, block);
        eg_add_scaled(z, g.h * (1.0 - g.zgamma), r, small);
        eg_multiply(zdot, -g.af / (1.0 - g.af), small);
        eg_add_scaled(zdot, g.zam / (1.0 - g.af), r, small);
        memset(x, 0, (size_t)(n * count) * sizeof *x);
        for (group = 0; group < 4; ++group) {
            double *rows = x + row_of[group] * count;
            eg_add_block(f.plan, in_q[group], own, -1.0, q, rows, count);
            if (in_v[group] >= 0)
                eg_add_block(f.plan, in_v[group], own, -1.0, v, rows, count);
            eg_add_block(f.plan, in_p[group], own, -1.0, dp, rows, count);
        }
        eg_add_block(f.plan, EG_M, own, -1.0, vdot, x, count);
        eg_add_block(f.plan, EG_RZ, own, -1.0, z, x, count);
        eg_add_block(f.plan, EG_FZ, own, -1.0, z, x + block, count);
        eg_add_scaled(x + block, -1.0, zdot, small);
        if (!eg_solve_step(&f, lane, 0, n, x, count, solved))
            return k;
        /* the end of the step */
        memcpy(a, x, (size_t)block * sizeof *a);
        eg_add_scaled(vdot, g.to_vdot, a, block);
        eg_add_scaled(v, g.h * g.gamma, a, block);
        memset(D, 0, (size_t)block * sizeof *D);
        eg_add_scaled(D, g.h * g.beta, a, block);
        if (nh) {
            eg_add_block_transposed(f.plan, EG_G, own, -1.0, x + (nv + nl) * count, D, count);
            memcpy(eta + k * nh * count, x + (nv + nl) * count, (size_t)(nh * count) * sizeof *eta);
        }
        eg_turn(given, T, 0, D, count, temporary);
        eg_add_scaled(q, g.h, D, block);
        memcpy(r, x + (nv + nl + nh) * count, (size_t)small * sizeof *r);
        eg_add_scaled(z, g.h * g.zgamma, r, small);
        eg_add_scaled(zdot, g.to_zdot, r, small);
        memcpy(record, q, (size_t)(3 * block) * sizeof *record);
        memcpy(record + 3 * block, z, (size_t)small * sizeof *record);
        memcpy(record + 3 * block + small, x + block, (size_t)(nl * count) * sizeof *record);
        record += (3 * nv + nz + nl) * count;
    }
    return given->steps;
}
