/* Linearised steps of generalized-alpha: tangents and adjoints of a run, exact for its discrete equations.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models. Bruls and Cardona 2010; Arnold, Bruls and Cardona 2015; discrete adjoints:
 * Griewank and Walther, Evaluating Derivatives (2008), chapter 4.
 *
 * A step from n to n + 1 with the exponent h D:
 *   D = v + h ((1/2 - beta) a + beta a') - W B^T eta,  q' = q o exp(h D),  v' = v + h ((1 - gamma) a + gamma a'),
 *   (1 - alpha_m) a' + alpha_m a = (1 - alpha_f) vdot' + alpha_f vdot,
 * internal states z with rates r in the same way, of first order, and the equations at the end of the step
 *   e(q', v', vdot', z', lam', p) + (0, zdot', 0, 0) = 0,
 * e: residual, minus the rates of internal states, holonomic constraints, rates of all constraints.
 * dq is left-trivialised: dq' = A dq + h T dD, A = Ad(exp(-h D)) and T the tangent of exp at h D; both are the identity
 * but for rotations. Unknowns of a step are da', dlam', deta and dr'.
 *
 * Matrices are row-major, one behind the other for each step; blocks of directions are (size, directions).
 */

/* Arguments of the caller. Pointers to matrices of steps: as many as there are steps, in their order. */
typedef struct eg_steps {
    long nv, nz, nl, nh; /* velocities, internal states, rows of constraints, holonomic ones with eta */
    long np, nown;       /* parameters; columns of P, of the first parameters */
    long steps, directions;
    long turns;          /* rotating factors: first velocity component and size (3 or 6) of each */
    const long *turn;
    const double *coefficients; /* h, alpha_m, alpha_f, beta, gamma, and alpha_m and gamma of first order */
    const double *Jq, *Jv, *Ja; /* (rows, nv): partials of e at the end of a step */
    const double *Jz;           /* (rows, nz) */
    const double *Jlam;         /* (rows, nl) */
    const double *P;            /* (rows, nown) */
    const double *A, *T;        /* of the rotating factors, one behind the other */
    const double *G;            /* (nh, nv): B W at the start of a step */
    const double *N;            /* (nv, nv): partials of W B^T eta in q there, */
    const double *Np;           /* (nv, np): and in the parameters; neither without holonomic ones */
    long *plan;                 /* of the elimination, made by the first sweep */
    double *scale;
} eg_steps;

typedef struct eg_gains {
    double h, am, af, gamma, beta, zam, zgamma;
    double to_vdot; /* d vdot'/d a' */
    double to_zdot; /* d zdot'/d r' */
} eg_gains;

static eg_gains eg_gains_of(const double *c)
{
    eg_gains g;
    g.h = c[0];
    g.am = c[1];
    g.af = c[2];
    g.beta = c[3];
    g.gamma = c[4];
    g.zam = c[5];
    g.zgamma = c[6];
    g.to_vdot = (1.0 - g.am) / (1.0 - g.af);
    g.to_zdot = (1.0 - g.zam) / (1.0 - g.af);
    return g;
}

/* D := X D in the rows of the rotating factors, or X^T D; room: 6 directions. */
static void eg_turn(const eg_steps *given, const double *X, int transposed, double *D, long count, double *room)
{
    long f;
    for (f = 0; f < given->turns; ++f) {
        const long first = given->turn[2 * f], size = given->turn[2 * f + 1];
        memset(room, 0, (size_t)(size * count) * sizeof *room);
        if (transposed)
            eg_add_transposed(room, 1.0, X, size, size, D + first * count, count);
        else
            eg_add(room, 1.0, X, size, size, D + first * count, count);
        memcpy(D + first * count, room, (size_t)(size * count) * sizeof *room);
        X += size * size;
    }
}

/* X (rows, nv) times T of a step, into Y. */
static void eg_times_tangent(const eg_steps *given, const double *X, const double *T, long rows, double *Y)
{
    const long nv = given->nv;
    long f, i, j, k;
    memcpy(Y, X, (size_t)(rows * nv) * sizeof *Y);
    for (f = 0; f < given->turns; ++f) {
        const long first = given->turn[2 * f], size = given->turn[2 * f + 1];
        for (i = 0; i < rows; ++i)
            for (j = 0; j < size; ++j) {
                double total = 0.0;
                for (k = 0; k < size; ++k)
                    total += X[i * nv + first + k] * T[k * size + j];
                Y[i * nv + first + j] = total;
            }
        T += size * size;
    }
}

/* Places of the matrices of a step. */
typedef struct eg_step {
    const double *Jq, *Jv, *Ja, *Jz, *Jlam, *P, *A, *T, *G, *N, *Np;
} eg_step;

static eg_step eg_step_of(const eg_steps *given, long k)
{
    const long nv = given->nv, nz = given->nz, nl = given->nl, nh = given->nh, np = given->np;
    const long rows = nv + nz + nh + nl;
    long f, turning = 0;
    eg_step at;
    for (f = 0; f < given->turns; ++f)
        turning += given->turn[2 * f + 1] * given->turn[2 * f + 1];
    at.Jq = given->Jq + k * rows * nv;
    at.Jv = given->Jv + k * rows * nv;
    at.Ja = given->Ja + k * rows * nv;
    at.Jz = given->Jz + k * rows * nz;
    at.Jlam = given->Jlam + k * rows * nl;
    at.P = given->P + k * rows * given->nown;
    at.A = given->A + k * turning;
    at.T = given->T + k * turning;
    at.G = given->G + k * nh * nv;
    at.N = given->N + (nh ? k * nv * nv : 0);
    at.Np = given->Np + (nh ? k * nv * np : 0);
    return at;
}

/* S = d equations/d unknowns (da', dlam', deta, dr'); JT: room for Jq T, (rows, nv), and then G^T, (nv, nh). */
static void eg_matrix(const eg_steps *given, const eg_gains *g, const eg_step *at, double *JT, double *S)
{
    const long nv = given->nv, nz = given->nz, nl = given->nl, nh = given->nh, n = nv + nz + nh + nl;
    long i, j, k;
    double *GT = JT + n * nv;
    eg_times_tangent(given, at->Jq, at->T, n, JT);
    for (k = 0; k < nv; ++k)
        for (j = 0; j < nh; ++j)
            GT[k * nh + j] = at->G[j * nv + k];
    for (i = 0; i < n; ++i) {
        double *line = S + i * n;
        for (j = 0; j < nv; ++j)
            line[j] = g->to_vdot * at->Ja[i * nv + j] + g->h * g->gamma * at->Jv[i * nv + j]
                + g->h * g->h * g->beta * JT[i * nv + j];
        for (j = 0; j < nl; ++j)
            line[nv + j] = at->Jlam[i * nl + j];
        memset(line + nv + nl, 0, (size_t)nh * sizeof *line);
        if (nh)
            eg_accumulate(line + nv + nl, -g->h, JT + i * nv, 1, nv, GT, nh);
        for (j = 0; j < nz; ++j)
            line[nv + nl + nh + j] = g->h * g->zgamma * at->Jz[i * nz + j] + (i == nv + j ? g->to_zdot : 0.0);
    }
}

/* Multipliers eta of velocities in steps: (B W B^T) eta = B moved. B of step k begins at B + k stride; W, (nv), is the same
 * for all steps or, with w_stride = nv, each step's own. moved: (nv) of each step. Fills G = B W (nh, nv), eta (nh) and
 * B^T eta (nv) of each step. room: nh nh + nh nv. Returns the number of the first step without a solution, else the number of
 * steps. */
EG_SEEN long eomgen_step_reactions(long steps, long nv, long nh, const double *B, long stride, const double *W,
    long w_stride, const double *moved, double *G, double *eta, double *reaction, double *room)
{
    double *S = room, *BT = S + nh * nh;
    long k, i, j;
    for (k = 0; k < steps; ++k, B += stride, W += w_stride, moved += nv, G += nh * nv, eta += nh, reaction += nv) {
        memset(S, 0, (size_t)(nh * nh) * sizeof *S);
        memset(eta, 0, (size_t)nh * sizeof *eta);
        memset(reaction, 0, (size_t)nv * sizeof *reaction);
        for (i = 0; i < nh; ++i)
            for (j = 0; j < nv; ++j) {
                BT[j * nh + i] = B[i * nv + j];
                G[i * nv + j] = B[i * nv + j] * W[j];
            }
        for (i = 0; i < nh; ++i) {
            eg_accumulate(S + i * nh, 1.0, G + i * nv, 1, nv, BT, nh);
            eg_accumulate(eta + i, 1.0, B + i * nv, 1, nv, moved, 1);
        }
        for (i = 0; i < nh; ++i) { /* rows of the upper factor, with their pivots */
            const double pivot = S[i * nh + i];
            if (!(pivot > 0.0))
                return k;
            for (j = i + 1; j < nh; ++j) {
                const double factor = S[i * nh + j] / pivot;
                if (factor != 0.0) {
                    eg_add_scaled(S + j * nh + j, -factor, S + i * nh + j, nh - j);
                    eta[j] -= factor * eta[i];
                }
            }
        }
        for (i = nh - 1; i >= 0; --i) {
            for (j = i + 1; j < nh; ++j)
                eta[i] -= S[i * nh + j] * eta[j];
            eta[i] /= S[i * nh + i];
        }
        eg_add_transposed(reaction, 1.0, B, nh, nv, eta, 1);
    }
    return steps;
}

/* Y := X D of each of so many rows: X (rows, columns), D (columns, directions), one behind the other. */
EG_SEEN void eomgen_step_products(long steps, long rows, long columns, long directions, const double *X, const double *D,
    double *Y)
{
    long k;
    memset(Y, 0, (size_t)(steps * rows * directions) * sizeof *Y);
    for (k = 0; k < steps; ++k)
        eg_add(Y + k * rows * directions, 1.0, X + k * rows * columns, rows, columns, D + k * columns * directions,
            directions);
}

EG_SEEN long eomgen_step_room(long nv, long nz, long nl, long nh, long directions)
{
    const long n = nv + nz + nh + nl;
    return n * n + n * nv + nv * nh + 2 * n + (2 * n + 5 * nv + 3 * nz + 6) * directions;
}

/* Plan the elimination by steps spread over all of them. nonzero: (n, n); counts: room for 3 n. */
EG_SEEN void eomgen_step_plan(const eg_steps *given, char *nonzero, long *counts, double *room)
{
    const long n = given->nv + given->nz + given->nh + given->nl;
    const eg_gains g = eg_gains_of(given->coefficients);
    double *S = room, *JT = S + n * n;
    eg_plan plan = eg_plan_in(given->plan, given->scale, n);
    long i, sample;
    *plan.made = -1;
    if (n < EG_SMALL)
        return;
    memset(nonzero, 0, (size_t)(n * n));
    for (sample = 0; sample < EG_SAMPLES; ++sample) {
        const eg_step at = eg_step_of(given, sample * (given->steps - 1) / (EG_SAMPLES - 1));
        eg_matrix(given, &g, &at, JT, S);
        for (i = 0; i < n * n; ++i)
            nonzero[i] |= S[i] != 0.0;
    }
    eg_make_plan(&plan, nonzero, S, counts, n);
}

/* Factors of a step's matrix: by the plan, or with pivots of its own. */
typedef struct eg_factors {
    const double *S, *row, *column;
    const long *pivot;
    eg_plan plan;
    int planned;
} eg_factors;

/* Factor the matrix of a step; 0: singular. */
static int eg_factors_of(const eg_steps *given, const eg_gains *g, const eg_step *at, double *JT, double *S,
    double *row, double *column, long *pivot, eg_factors *factors)
{
    const long n = given->nv + given->nz + given->nh + given->nl;
    eg_matrix(given, g, at, JT, S);
    factors->S = S;
    factors->row = row;
    factors->column = column;
    factors->pivot = pivot;
    factors->plan = eg_plan_in(given->plan, given->scale, n);
    factors->planned = *factors->plan.made == 1 && eg_factor_planned(&factors->plan, S, n);
    if (factors->planned)
        return 1;
    if (*factors->plan.made == 1)
        eg_matrix(given, g, at, JT, S);
    return eg_factor(S, row, column, pivot, n);
}

/* X := S^-1 X, or S^-T X; room: as many numbers. */
static void eg_solve_factored(const eg_factors *f, int transposed, long n, double *X, long count, double *room)
{
    if (f->planned && transposed)
        eg_solve_planned_transposed(&f->plan, f->S, n, X, count, room);
    else if (f->planned)
        eg_solve_planned(&f->plan, f->S, n, X, count, room);
    else if (transposed)
        eg_solve_transposed(f->S, f->row, f->column, f->pivot, n, X, count);
    else
        eg_solve(f->S, f->row, f->column, f->pivot, n, X, count);
}

/* Tangents through the steps. state, in and out, (4 nv + 3 nz, directions): dq, dv, dvdot, da, dz, dzdot, dr. dp: (np,
 * directions). record, of each step, (3 nv + nz + nl, directions): dq, dv, dvdot, dz, dlam at its end; eta, of each step,
 * (nh, directions). Returns the number of the first step whose matrix is singular, else the number of steps. */
EG_SEEN long eomgen_step_tangents(const eg_steps *given, const double *dp, double *state, double *record, double *eta,
    double *room, long *pivot)
{
    const long nv = given->nv, nz = given->nz, nl = given->nl, nh = given->nh, np = given->np;
    const long n = nv + nz + nh + nl, count = given->directions, block = nv * count, small = nz * count;
    const eg_gains g = eg_gains_of(given->coefficients);
    double *S = room, *JT = S + n * n, *row = JT + n * nv + nv * nh, *column = row + n, *x = column + n, *D = x + n * count,
        *temporary = D + block, *solved = temporary + 6 * count;
    double *q = state, *v = q + block, *vdot = v + block, *a = vdot + block, *z = a + block, *zdot = z + small,
        *r = zdot + small;
    long k;
    for (k = 0; k < given->steps; ++k) {
        const eg_step at = eg_step_of(given, k);
        eg_factors factors;
        if (!eg_factors_of(given, &g, &at, JT, S, row, column, pivot, &factors))
            return k;
        /* the part that the unknowns do not change */
        memcpy(D, v, (size_t)block * sizeof *D);
        eg_add_scaled(D, g.h * (0.5 - g.beta), a, block);
        if (nh) {
            eg_add(D, -1.0, at.N, nv, nv, q, count);
            eg_add(D, -1.0, at.Np, nv, np, dp, count);
        }
        eg_turn(given, at.A, 0, q, count, temporary);
        eg_turn(given, at.T, 0, D, count, temporary);
        eg_add_scaled(q, g.h, D, block);
        eg_add_scaled(v, g.h * (1.0 - g.gamma), a, block);
        eg_multiply(vdot, -g.af / (1.0 - g.af), block);
        eg_add_scaled(vdot, g.am / (1.0 - g.af), a, block);
        eg_add_scaled(z, g.h * (1.0 - g.zgamma), r, small);
        eg_multiply(zdot, -g.af / (1.0 - g.af), small);
        eg_add_scaled(zdot, g.zam / (1.0 - g.af), r, small);
        memset(x, 0, (size_t)(n * count) * sizeof *x);
        eg_add(x, -1.0, at.Jq, n, nv, q, count);
        eg_add(x, -1.0, at.Jv, n, nv, v, count);
        eg_add(x, -1.0, at.Ja, n, nv, vdot, count);
        eg_add(x, -1.0, at.Jz, n, nz, z, count);
        eg_add(x, -1.0, at.P, n, given->nown, dp, count);
        eg_add_scaled(x + block, -1.0, zdot, small);
        eg_solve_factored(&factors, 0, n, x, count, solved);
        /* the end of the step */
        memcpy(a, x, (size_t)block * sizeof *a);
        eg_add_scaled(vdot, g.to_vdot, a, block);
        eg_add_scaled(v, g.h * g.gamma, a, block);
        memset(D, 0, (size_t)block * sizeof *D);
        eg_add_scaled(D, g.h * g.beta, a, block);
        if (nh) {
            eg_add_transposed(D, -1.0, at.G, nh, nv, x + (nv + nl) * count, count);
            memcpy(eta + k * nh * count, x + (nv + nl) * count, (size_t)(nh * count) * sizeof *eta);
        }
        eg_turn(given, at.T, 0, D, count, temporary);
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

/* Adjoints through the steps, from the last to the first. state, in and out, (4 nv + 3 nz, directions): derivatives of
 * the functionals in q, v, vdot, a, z, zdot, r at the end of the last step, without their direct part of that
 * row; then at the start of the first. direct, of each step, (3 nv + nz + nl, directions): the direct part of
 * functionals at the row of its end. gradient: (np, directions), to which the derivatives in parameters are added.
 * multipliers: of the equations of each step, (rows, directions). ends, of each step, (2 nv, directions): derivatives
 * in q' and in D. sources, of each step, (2 nv + nh, directions), or NULL: additions to the derivatives in q at its start, in
 * h D and in eta, if these are differentiated once more. */
EG_SEEN long eomgen_step_adjoints(const eg_steps *given, const double *direct, const double *sources, double *state,
    double *gradient, double *multipliers, double *ends, double *room, long *pivot)
{
    const long nv = given->nv, nz = given->nz, nl = given->nl, nh = given->nh, np = given->np;
    const long n = nv + nz + nh + nl, count = given->directions, block = nv * count, small = nz * count;
    const eg_gains g = eg_gains_of(given->coefficients);
    double *S = room, *JT = S + n * n, *row = JT + n * nv + nv * nh, *column = row + n, *D = column + n, *temporary = D + block,
        *solved = temporary + 6 * count;
    double *q = state, *v = q + block, *vdot = v + block, *a = vdot + block, *z = a + block, *zdot = z + small,
        *r = zdot + small;
    long k;
    for (k = given->steps - 1; k >= 0; --k) {
        const eg_step at = eg_step_of(given, k);
        const double *own = direct + k * (3 * nv + nz + nl) * count;
        const double *source = sources ? sources + k * (2 * nv + nh) * count : sources;
        double *x = multipliers + k * n * count;
        eg_factors factors;
        long i;
        if (!eg_factors_of(given, &g, &at, JT, S, row, column, pivot, &factors))
            return k;
        eg_add_scaled(q, 1.0, own, 3 * block);
        eg_add_scaled(z, 1.0, own + 3 * block, small);
        /* of the unknowns */
        memcpy(D, q, (size_t)block * sizeof *D);
        eg_turn(given, at.T, 1, D, count, temporary);
        if (source)
            eg_add_scaled(D, 1.0, source + block, block);
        memset(x, 0, (size_t)(n * count) * sizeof *x);
        for (i = 0; i < block; ++i)
            x[i] = a[i] + g.h * g.gamma * v[i] + g.to_vdot * vdot[i] + g.h * g.h * g.beta * D[i];
        memcpy(x + block, own + 3 * block + small, (size_t)(nl * count) * sizeof *x);
        if (nh)
            eg_add(x + (nv + nl) * count, -g.h, at.G, nh, nv, D, count);
        if (nh && source)
            eg_add_scaled(x + (nv + nl) * count, 1.0, source + 2 * block, nh * count);
        for (i = 0; i < small; ++i)
            x[(nv + nl + nh) * count + i] = r[i] + g.h * g.zgamma * z[i] + g.to_zdot * zdot[i];
        eg_solve_factored(&factors, 1, n, x, count, solved);
        /* of the part that the unknowns do not change */
        eg_add_transposed(q, -1.0, at.Jq, n, nv, x, count);
        eg_add_transposed(v, -1.0, at.Jv, n, nv, x, count);
        eg_add_transposed(vdot, -1.0, at.Ja, n, nv, x, count);
        eg_add_transposed(z, -1.0, at.Jz, n, nz, x, count);
        eg_add_transposed(gradient, -1.0, at.P, n, given->nown, x, count);
        eg_add_scaled(zdot, -1.0, x + block, small);
        /* of the start of the step */
        memcpy(D, q, (size_t)block * sizeof *D);
        memcpy(ends + 2 * k * block, q, (size_t)block * sizeof *ends);
        eg_turn(given, at.T, 1, D, count, temporary);
        if (source)
            eg_add_scaled(D, 1.0, source + block, block);
        for (i = 0; i < block; ++i)
            D[i] *= g.h;
        memcpy(ends + (2 * k + 1) * block, D, (size_t)block * sizeof *ends);
        eg_turn(given, at.A, 1, q, count, temporary);
        if (source)
            eg_add_scaled(q, 1.0, source, block);
        if (nh) {
            eg_add_transposed(q, -1.0, at.N, nv, nv, D, count);
            eg_add_transposed(gradient, -1.0, at.Np, nv, np, D, count);
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
