/* Steps of time-discontinuous Galerkin methods made linear: their passes again, tangents and adjoints through them.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models. Griewank and Walther, Evaluating Derivatives (2008), chapter 4; the passes
 * are described in eomgen/integrators/families/discontinuous_galerkin.py.
 *
 * A step is a fixed number of passes over nodes i, which have changes theta_i, w_i, y_i of q (q = q_0 o exp(theta)), v
 * and z from the start x_0 = (q_0, v_0, a_0, z_0), all 0 before the first pass, and accelerations a_i = sum D_ij w_j / h;
 * e are the equations there: residual, minus the rates of internal states. A pass begins with
 *   f_i = -e(q_i, v_i, a_i, z_i),   r_i = T(theta_i)^-1 v_i,
 * or, if it is refined, with f_i = -e(q_i, v_i, a_i - x_v, z_i) - (M_0 x_v, 0), S x = (residual_i, 0), and finds
 * polynomial by polynomial
 *   e'(x_0) xi_j + (0, sum_(l<=j) x_l,z) = sum_(l<=j) sum_i (h I_li f_i - (0, B_li y_i)),   d_j = T_0 u_j,
 *   u_j = sum_(l<=j) sum_i (h I_li r_i - B_li theta_i) - sum_(l<j) d_l + g x_j,v,
 *   xi_j = (g d_j, g x_j,v, sum_(l<=j) x_l,v, g x_j,z),
 * g = gamma h, T_0 = T(g v_0), I integrals of a pass, B coefficients of values, both by modes; S is e'(x_0) of an x_j
 * and x_j,z. Behind it theta_i += sum V_ij d_j, w and y in the same way by x_j. In the first pass B is left out, a_i
 * is 0, and nodes differ in time alone.
 *
 * How e'(x_0) changes along xi, e''[xi, .], a function of the model says: to tangents row by row, to adjoints contracted
 * with their multipliers. Pairs are such xi in the order in which they occur: of a refined pass the pairs of S x for
 * each node, then (0, 0, x_v, 0), and in each pass the pairs of the modes.
 *
 * Arrays are (number, steps, size, directions), number a node, mode, pair or point; points are the arguments of e: of
 * the first pass, then in each later one the nodes, and these again if it is refined.
 */

/* Second derivatives of the equations at the starts of steps, by a function of the model for a batch of samples: changes
 * of gradients of weights . (residual, rates) along directions. */
typedef struct eg_curvature {
    int (*call)(int function, long count, const double *const *inputs, const long *strides, double *const *outputs);
    int function;
    long inputs;             /* blocks, of which two are named below */
    const double **input;    /* of the first step, then of the next: moved by of_step */
    const long *of_step;     /* doubles of a step; 0 for blocks that are the same in all */
    const long *strides;     /* doubles of a sample, 0 but for weights and direction */
    long weights, direction; /* numbers of these blocks */
    long weighted, moved;    /* their sizes; of direction: q, v, a, z, then parameters and inputs */
    eg_number *room;         /* (samples, weighted + 2 moved) and rows: samples are pairs of tangents times rows */
} eg_curvature;

/* Arguments of the caller. */
typedef struct eg_passes {
    long nv, nz, np;
    long nodes, passes, refined;
    long first; /* points of the first pass: 1 if no function depends on time, else one for each node */
    long steps, directions;
    long turns; /* rotating factors: first velocity component and size of each */
    const long *turn;
    double step, gain;
    const double *first_integral, *integral, *modes, *values, *derivative; /* (nodes, nodes) */
    const eg_number *Jq0, *Jv0, *Ja0, *Jz0;    /* partials at the starts, (steps, rows, nv), or nz */
    const eg_number *T0;                       /* blocks of rotating factors, one behind the other, for each step */
    eg_number *S;                              /* (steps, rows, rows), and its scales (steps, 2, rows): in factors */
    eg_number *scales;
    long *pivot;                               /* (steps, rows) */
    const eg_number *Jq, *Jv, *Ja, *Jz, *P;    /* partials at the points, (points, steps, rows, nv), nz or np */
    const eg_number *A, *T;                    /* of rotating factors at the nodes of later passes, then at the end */
    const eg_number *rate, *rate_along;        /* T^-1 there but the end, and its partials times v_i */
    const eg_number *T0_along;                 /* of pairs: partials of T(g v) u in v; 0 of those without T */
    const eg_number *along;                    /* pairs, (pairs, steps, 3 nv + nz) */
    const double *brackets;                    /* of rotating factors: ad of unit velocities, one behind the other */
} eg_passes;

static long eg_rows(const eg_passes *g) { return g->nv + g->nz; }

static long eg_width(const eg_passes *g) { return 3 * g->nv + g->nz; }

/* Pairs of a later pass, and the first pair of a pass. */
static long eg_pairs(const eg_passes *g) { return (g->refined ? 3 : 1) * g->nodes; }

static long eg_first_pair(const eg_passes *g, long pass)
{
    return pass ? g->nodes + (pass - 1) * eg_pairs(g) : 0;
}

static long eg_first_point(const eg_passes *g, long pass)
{
    return pass ? g->first + (pass - 1) * (g->refined ? 2 : 1) * g->nodes : 0;
}

/* Numbers of the blocks of rotating factors. */
static long eg_turning(const eg_passes *g)
{
    long f, total = 0;
    for (f = 0; f < g->turns; ++f)
        total += g->turn[2 * f + 1] * g->turn[2 * f + 1];
    return total;
}

/* Y += s X D in the rows of rotating factors, or X^T D. */
static void eg_add_turned(const eg_passes *g, eg_number *Y, double s, const eg_number *X, int transposed,
    const eg_number *D, long count)
{
    long f;
    for (f = 0; f < g->turns; ++f) {
        const long first = g->turn[2 * f], size = g->turn[2 * f + 1];
        if (transposed)
            eg_add_transposed(Y + first * count, s, X, size, size, D + first * count, count);
        else
            eg_add(Y + first * count, s, X, size, size, D + first * count, count);
        X += size * size;
    }
}

/* Whether a component turns; else T is 1 there. */
static int eg_turns(const eg_passes *g, long i)
{
    long f;
    for (f = 0; f < g->turns; ++f)
        if (i >= g->turn[2 * f] && i < g->turn[2 * f] + g->turn[2 * f + 1])
            return 1;
    return 0;
}

/* Y += s D in the rows that do not turn. */
static void eg_add_plain(const eg_passes *g, eg_number *Y, double s, const eg_number *D, long count)
{
    long i;
    if (!g->turns) {
        eg_add_scaled(Y, s, D, g->nv * count);
        return;
    }
    for (i = 0; i < g->nv; ++i)
        if (!eg_turns(g, i))
            eg_add_scaled(Y + i * count, s, D + i * count, count);
}

/* Y += s T D of blocks of rotating factors, and of other components, for which T is 1. */
static void eg_add_tangent(const eg_passes *g, eg_number *Y, double s, const eg_number *T, int transposed,
    const eg_number *D, long count)
{
    eg_add_turned(g, Y, s, T, transposed, D, count);
    eg_add_plain(g, Y, s, D, count);
}

static void eg_solve_step(const eg_passes *g, long k, eg_number *X, long count)
{
    const long n = eg_rows(g);
    const eg_number *scales = g->scales + 2 * k * n;
    eg_solve(g->S + k * n * n, scales, scales + n, g->pivot + k * n, n, X, count);
}

static void eg_solve_step_transposed(const eg_passes *g, long k, eg_number *X, long count)
{
    const long n = eg_rows(g);
    const eg_number *scales = g->scales + 2 * k * n;
    eg_solve_transposed(g->S + k * n * n, scales, scales + n, g->pivot + k * n, n, X, count);
}

/* Takes steps one by one by a stepper, and keeps of each the memory that it begins with, `size` numbers of its state.
 * Returns the status of the last one. */
EG_SEEN int eomgen_passes_run(int (*run)(const double *parameters, const double *settings, double *state,
    double *workspace, long steps, long record_every, const double *table, double *record, long *recorded),
    const double *parameters, const double *settings, double *state, double *workspace, long steps,
    const double *table, long of_step, const double *kept, long size, double *memory, double *record, long row)
{
    long k, recorded;
    for (k = 0; k < steps; ++k) {
        int status;
        memcpy(memory + k * size, kept, (size_t)size * sizeof *memory);
        status = run(parameters, settings, state, workspace, 1, 1, table ? table + k * of_step : table,
            record + k * row, &recorded);
        if (status)
            return status;
    }
    return 0;
}

/* Inputs of a function of the model become the inputs of another step, so many ahead. */
static void eg_move_inputs(const eg_curvature *by, long steps)
{
    long i;
    for (i = 0; i < by->inputs; ++i)
        by->input[i] += by->of_step[i] * steps;
}

/* Weights (rows) of a sample that picks the sum of multipliers times e, which has minus the rates. */
static void eg_weigh(const eg_passes *g, double sign, const eg_number *multipliers, eg_number *weights)
{
    long i;
    for (i = 0; i < eg_rows(g); ++i)
        weights[i] = i < g->nv ? sign * multipliers[i] : -sign * multipliers[i];
}

/* gradient (3 nv + nz) += s times force (nv), Jq_0 times a row of multipliers, times ad of xi in q: e'' is along increments
 * of the start, gradients are left-trivialised. */
static void eg_add_brackets(const eg_passes *g, double s, const eg_number *force, const eg_number *xi,
    eg_number *gradient, long step)
{
    const double *bracket = g->brackets;
    long f, c, r, i;
    for (f = 0; f < g->turns; ++f) {
        const long first = g->turn[2 * f], size = g->turn[2 * f + 1];
        for (c = 0; c < size; ++c)
            for (r = 0; r < size; ++r)
                for (i = 0; i < size; ++i)
                    gradient[(first + i) * step] += s * xi[first + c] * bracket[(c * size + r) * size + i]
                        * force[first + r];
        bracket += size * size * size;
    }
}

/* -- the passes again ------------------------------------------------------------------------------------------------ */

/* Factors of the matrices of all steps; room: (rows + 1) nv. Returns the number of the first singular one. */
EG_SEEN long eomgen_passes_begin(const eg_passes *g, eg_number *room)
{
    const long nv = g->nv, nz = g->nz, n = eg_rows(g), turning = eg_turning(g);
    long k, i, j;
    for (k = 0; k < g->steps; ++k) {
        const eg_number *Jq = g->Jq0 + k * n * nv, *Jv = g->Jv0 + k * n * nv, *Ja = g->Ja0 + k * n * nv;
        eg_number *S = g->S + k * n * n;
        memset(room, 0, (size_t)(n * nv) * sizeof *room);
        for (i = 0; i < n; ++i) /* a row of Jq T_0 is T_0^T of it */
            eg_add_tangent(g, room + i * nv, 1.0, g->T0 + k * turning, 1, Jq + i * nv, 1);
        for (i = 0; i < n; ++i) {
            for (j = 0; j < nv; ++j)
                S[i * n + j] = Ja[i * nv + j] + g->gain * (Jv[i * nv + j] + g->gain * room[i * nv + j]);
            for (j = 0; j < nz; ++j)
                S[i * n + nv + j] = g->gain * g->Jz0[(k * n + i) * nz + j] + (i == nv + j ? 1.0 : 0.0);
        }
        if (!eg_factor(S, g->scales + 2 * k * n, g->scales + (2 * k + 1) * n, g->pivot + k * n, n))
            return k;
    }
    return g->steps;
}

/* xi of an x whose theta is d. */
static void eg_pair(const eg_passes *g, const eg_number *d, const eg_number *x, const eg_number *accelerations,
    eg_number *xi)
{
    long i;
    for (i = 0; i < g->nv; ++i) {
        xi[i] = g->gain * d[i];
        xi[g->nv + i] = g->gain * x[i];
        xi[2 * g->nv + i] = accelerations[i];
    }
    for (i = 0; i < g->nz; ++i)
        xi[3 * g->nv + i] = g->gain * x[g->nv + i];
}

/* Accelerations of the nodes become accelerations of a refined pass, and missing, the residuals there (nodes, steps,
 * nv), M_0 times their corrections. along, before: pairs of the pass and their u; room: rows + nv. */
EG_SEEN void eomgen_passes_refine(const eg_passes *g, eg_number *missing, eg_number *accelerations, eg_number *along,
    eg_number *before, eg_number *room)
{
    const long nv = g->nv, n = eg_rows(g), width = eg_width(g), turning = eg_turning(g);
    eg_number *x = room, *d = room + n;
    long node, k, i;
    for (node = 0; node < g->nodes; ++node)
        for (k = 0; k < g->steps; ++k) {
            const long at = node * g->steps + k, behind = (g->nodes + node) * g->steps + k;
            eg_number *r = missing + at * nv, *a = accelerations + at * nv;
            memset(x, 0, (size_t)(n + nv) * sizeof *x);
            memcpy(x, r, (size_t)nv * sizeof *x);
            eg_solve_step(g, k, x, 1);
            for (i = 0; i < nv; ++i) {
                before[at * nv + i] = g->gain * x[i];
                a[i] -= x[i];
                along[behind * width + 2 * nv + i] = x[i];
            }
            eg_add_tangent(g, d, 1.0, g->T0 + k * turning, 0, before + at * nv, 1);
            eg_pair(g, d, x, x, along + at * width);
            memset(r, 0, (size_t)nv * sizeof *r);
            eg_add(r, 1.0, g->Ja0 + k * n * nv, nv, nv, x, 1);
        }
}

/* The corrections of a pass. f: (points of the pass, steps, rows); rates (nodes, steps, nv), of the first pass (1, ...).
 * theta, w, y: at the nodes, changed. along, before: pairs of its modes and their u. room: 4 rows + 2 nv. */
EG_SEEN void eomgen_passes_correct(const eg_passes *g, long pass, const eg_number *f, const eg_number *rates,
    eg_number *theta, eg_number *w, eg_number *y, eg_number *along, eg_number *before, eg_number *room)
{
    const long nv = g->nv, nz = g->nz, n = eg_rows(g), m = g->nodes, width = eg_width(g), turning = eg_turning(g);
    const double *integral = pass ? g->integral : g->first_integral;
    eg_number *right = room, *x = right + n, *sum = x + n, *carried = sum + n, *turned = carried + n,
        *gone = turned + nv;
    long k, node, mode, i;
    for (k = 0; k < g->steps; ++k) {
        const eg_number *T0 = g->T0 + k * turning;
        memset(right, 0, (size_t)(4 * n + 2 * nv) * sizeof *right);
        for (mode = 0; mode < m; ++mode) {
            eg_number *u = before + (mode * g->steps + k) * nv, *xi = along + (mode * g->steps + k) * width;
            for (node = 0; node < m; ++node) {
                const double weight = g->step * integral[mode * m + node];
                eg_add_scaled(right, weight, f + ((pass || g->first > 1 ? node : 0) * g->steps + k) * n, n);
                eg_add_scaled(turned, weight, rates + ((pass ? node : 0) * g->steps + k) * nv, nv);
            }
            for (node = 0; pass && node < m; ++node) {
                const double weight = -g->modes[mode * m + node];
                eg_add_scaled(turned, weight, theta + (node * g->steps + k) * nv, nv);
                eg_add_scaled(right + nv, weight, y + (node * g->steps + k) * nz, nz);
            }
            memcpy(u, turned, (size_t)nv * sizeof *u);
            eg_add_scaled(u, -1.0, gone, nv);
            memset(carried, 0, (size_t)nv * sizeof *carried);
            eg_add_tangent(g, carried, 1.0, T0, 0, u, 1);
            memcpy(x, right, (size_t)n * sizeof *x);
            eg_add(x, -1.0, g->Ja0 + k * n * nv, n, nv, sum, 1);
            eg_add(x, -g->gain, g->Jq0 + k * n * nv, n, nv, carried, 1);
            eg_add_scaled(x + nv, -1.0, sum + nv, nz);
            eg_solve_step(g, k, x, 1);
            eg_add_scaled(u, g->gain, x, nv);
            memset(carried, 0, (size_t)nv * sizeof *carried);
            eg_add_tangent(g, carried, 1.0, T0, 0, u, 1);
            eg_add_scaled(gone, 1.0, carried, nv);
            eg_add_scaled(sum, 1.0, x, n);
            eg_pair(g, carried, x, sum, xi);
        }
        for (mode = 0; mode < m; ++mode) {
            const eg_number *xi = along + (mode * g->steps + k) * width;
            const eg_number *last = mode ? along + ((mode - 1) * g->steps + k) * width + 2 * nv : NULL;
            for (node = 0; node < m; ++node) {
                const double value = g->values[node * m + mode];
                eg_number *own = w + (node * g->steps + k) * nv;
                eg_add_scaled(theta + (node * g->steps + k) * nv, value / g->gain, xi, nv);
                for (i = 0; i < nv; ++i)
                    own[i] += value * (xi[2 * nv + i] - (last ? last[i] : 0.0));
                eg_add_scaled(y + (node * g->steps + k) * nz, value / g->gain, xi + 3 * nv, nz);
            }
        }
    }
}
