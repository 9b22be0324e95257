/* Tangents through steps of time-discontinuous Galerkin methods, statement by statement of their passes.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models. Griewank and Walther, Evaluating Derivatives (2008), chapter 3.
 */

/* Changes at a node. */
typedef struct eg_moved {
    const eg_number *q, *v, *a, *z; /* (size, directions); a: NULL if it stays 0 */
} eg_moved;

/* Y += s de of a point in its first rows. */
static void eg_add_equations(const eg_passes *g, long point, long k, long rows, double s, eg_moved moved,
    const eg_number *dp, eg_number *Y)
{
    const long nv = g->nv, count = g->directions, at = (point * g->steps + k) * eg_rows(g);
    eg_add(Y, s, g->Jq + at * nv, rows, nv, moved.q, count);
    eg_add(Y, s, g->Jv + at * nv, rows, nv, moved.v, count);
    if (moved.a)
        eg_add(Y, s, g->Ja + at * nv, rows, nv, moved.a, count);
    eg_add(Y, s, g->Jz + at * g->nz, rows, g->nz, moved.z, count);
    eg_add(Y, s, g->P + at * g->np, rows, g->np, dp, count);
}

/* e''[xi, .] of all pairs of a step, (pairs, rows, moved), or NULL if a function of the model failed. */
static const eg_number *eg_second(const eg_passes *g, const eg_curvature *by, long k)
{
    const long n = eg_rows(g), width = eg_width(g), pairs = eg_first_pair(g, g->passes);
    eg_number *weights = by->room, *moved = weights + pairs * n * by->weighted, *found = moved + pairs * n * by->moved,
        *unit = found + pairs * n * by->moved;
    double *results[1];
    long pair, r;
    results[0] = (double *)found;
    by->input[by->weights] = (const double *)weights;
    by->input[by->direction] = (const double *)moved;
    memset(weights, 0, (size_t)(pairs * n * (by->weighted + by->moved) ) * sizeof *weights);
    memset(unit, 0, (size_t)n * sizeof *unit);
    for (pair = 0; pair < pairs; ++pair)
        for (r = 0; r < n; ++r) {
            unit[r] = 1.0;
            eg_weigh(g, 1.0, unit, weights + (pair * n + r) * by->weighted);
            unit[r] = 0.0;
            memcpy(moved + (pair * n + r) * by->moved, g->along + (pair * g->steps + k) * width,
                (size_t)width * sizeof *moved);
        }
    if (by->call(by->function, pairs * n, by->input, by->strides, results))
        return NULL;
    for (pair = 0; g->turns && pair < pairs; ++pair)
        for (r = 0; r < n; ++r)
            eg_add_brackets(g, -1.0, g->Jq0 + (k * n + r) * g->nv, moved + (pair * n + r) * by->moved,
                found + (pair * n + r) * by->moved, 1);
    return found;
}

/* Changes of the start of a step along the directions: (q, v, a, z) and, behind z, other arguments of e'',
 * (moved - width, ...). */
typedef struct eg_begun {
    const eg_number *second, *state, *rest;
    long moved;
} eg_begun;

/* Y -= e''[xi, .] of a pair along the start of the step, in its first rows. */
static void eg_take_second(const eg_passes *g, long pair, long rows, eg_begun begun, eg_number *Y)
{
    const long width = eg_width(g), count = g->directions;
    const eg_number *X = begun.second + pair * eg_rows(g) * begun.moved;
    long i;
    for (i = 0; i < rows; ++i) {
        eg_accumulate(Y + i * count, -1.0, X + i * begun.moved, 1, width, begun.state, count);
        eg_accumulate(Y + i * count, -1.0, X + i * begun.moved + width, 1, begun.moved - width, begun.rest, count);
    }
}

/* Turned directions T_0 du and derivatives of T_0 along dv, of a pair, into d; its change of right sides is taken
 * off X. */
static void eg_turn_pair(const eg_passes *g, long pair, long k, const eg_number *du, const eg_number *dv, eg_number *d,
    eg_number *X)
{
    const long nv = g->nv, n = eg_rows(g), turning = eg_turning(g), count = g->directions;
    memset(d, 0, (size_t)(nv * count) * sizeof *d);
    eg_add_turned(g, d, 1.0, g->T0_along + (pair * g->steps + k) * turning, 0, dv, count);
    if (du)
        eg_add_tangent(g, d, 1.0, g->T0 + k * turning, 0, du, count);
    if (du || g->turns)
        eg_add(X, -g->gain, g->Jq0 + k * n * nv, n, nv, d, count);
}

EG_SEEN long eomgen_passes_tangent_room(const eg_passes *g)
{
    const long nv = g->nv, n = eg_rows(g);
    return ((5 * g->nodes + 7) * nv + (2 * g->nodes + 3) * n + (g->nodes + 1) * g->nz) * g->directions;
}

/* Tangents through the steps. state, in and out, (3 nv + nz, directions): dq, dv, da, dz; dp (np, directions). rest, of
 * each step, or of all if rest_of_step is 0: arguments of e'' at its start behind z, (moved - (3 nv + nz),
 * directions). ends, of each step: the state at its end. Returns the number of steps, or -1 if a function of the model
 * failed. */
EG_SEEN long eomgen_passes_tangents(const eg_passes *g, const eg_curvature *by, const eg_number *dp,
    const eg_number *rest, long rest_of_step, eg_number *state, eg_number *ends, eg_number *room)
{
    const long nv = g->nv, nz = g->nz, n = eg_rows(g), m = g->nodes, width = eg_width(g), count = g->directions;
    const long block = nv * count, small = nz * count, all = n * count, turning = eg_turning(g);
    const eg_number *q = state, *v = q + block, *z = v + 2 * block;
    eg_number *theta = room, *w = theta + m * block, *y = w + m * block, *rates = y + m * small,
        *d = rates + m * block, *x = d + m * block, *f = x + m * all, *right = f + m * all, *sum = right + all,
        *X = sum + all, *turned = X + all, *gone = turned + block, *u = gone + block, *dq = u + block,
        *dv = dq + block, *da = dv + block, *dz = da + block, *extra = dz + small;
    long k, pass, node, mode, i;
    for (k = 0; k < g->steps; ++k) {
        const eg_number *T0 = g->T0 + k * turning;
        const eg_begun begun = { eg_second(g, by, k), state, rest + k * rest_of_step, by->moved };
        if (!begun.second)
            return -1;
        eg_move_inputs(by, 1);
        memset(theta, 0, (size_t)(m * (2 * block + small)) * sizeof *theta);
        for (pass = 0; pass < g->passes; ++pass) {
            const double *integral = pass ? g->integral : g->first_integral;
            const long pair = eg_first_pair(g, pass), point = eg_first_point(g, pass);
            const long modes = pair + (pass && g->refined ? 2 * m : 0);
            memset(f, 0, (size_t)(m * all) * sizeof *f);
            for (node = 0; node < m; ++node) {
                const long place = ((pass - 1) * m + node) * g->steps + k;
                const eg_moved moved = { pass ? dq : q, pass ? dv : v, pass ? da : NULL, pass ? dz : z };
                eg_number *own = f + node * all, *rate = rates + node * block;
                if (!pass) {
                    if (node < g->first)
                        eg_add_equations(g, point + node, k, n, -1.0, moved, dp, own);
                    else
                        memcpy(own, f, (size_t)all * sizeof *own);
                    memcpy(rate, v, (size_t)block * sizeof *rate);
                    continue;
                }
                memset(dq, 0, (size_t)block * sizeof *dq);
                eg_add_tangent(g, dq, 1.0, g->A + place * turning, 0, q, count);
                eg_add_tangent(g, dq, 1.0, g->T + place * turning, 0, theta + node * block, count);
                memcpy(dv, v, (size_t)block * sizeof *dv);
                eg_add_scaled(dv, 1.0, w + node * block, block);
                memcpy(dz, z, (size_t)small * sizeof *dz);
                eg_add_scaled(dz, 1.0, y + node * small, small);
                memset(da, 0, (size_t)block * sizeof *da);
                for (i = 0; i < m; ++i)
                    eg_add_scaled(da, g->derivative[node * m + i] / g->step, w + i * block, block);
                memset(rate, 0, (size_t)block * sizeof *rate);
                eg_add_tangent(g, rate, 1.0, g->rate + place * turning, 0, dv, count);
                eg_add_turned(g, rate, 1.0, g->rate_along + place * turning, 0, theta + node * block, count);
                if (!g->refined) {
                    eg_add_equations(g, point + node, k, n, -1.0, moved, dp, own);
                    continue;
                }
                memset(X, 0, (size_t)all * sizeof *X);
                eg_add_equations(g, point + node, k, nv, 1.0, moved, dp, X);
                eg_turn_pair(g, pair + node, k, NULL, v, u, X);
                eg_take_second(g, pair + node, n, begun, X);
                eg_solve_step(g, k, X, count);
                eg_add_scaled(da, -1.0, X, block);
                eg_add_equations(g, point + m + node, k, n, -1.0, moved, dp, own);
                eg_add(own, -1.0, g->Ja0 + k * n * nv, nv, nv, X, count);
                memset(extra, 0, (size_t)all * sizeof *extra);
                eg_take_second(g, pair + m + node, nv, begun, extra);
                eg_add_scaled(own, 1.0, extra, block);
            }
            memset(right, 0, (size_t)(2 * all) * sizeof *right);
            memset(turned, 0, (size_t)(2 * block) * sizeof *turned);
            for (mode = 0; mode < m; ++mode) {
                eg_number *own = x + mode * all, *own_d = d + mode * block;
                for (node = 0; node < m; ++node) {
                    const double weight = g->step * integral[mode * m + node], gone_by = -g->modes[mode * m + node];
                    eg_add_scaled(right, weight, f + node * all, all);
                    eg_add_scaled(turned, weight, rates + node * block, block);
                    if (!pass)
                        continue;
                    eg_add_scaled(turned, gone_by, theta + node * block, block);
                    eg_add_scaled(right + block, gone_by, y + node * small, small);
                }
                memcpy(u, turned, (size_t)block * sizeof *u);
                eg_add_scaled(u, -1.0, gone, block);
                memcpy(own, right, (size_t)all * sizeof *own);
                eg_add(own, -1.0, g->Ja0 + k * n * nv, n, nv, sum, count);
                eg_add_scaled(own + block, -1.0, sum + block, small);
                eg_turn_pair(g, modes + mode, k, u, v, own_d, own);
                eg_take_second(g, modes + mode, n, begun, own);
                eg_solve_step(g, k, own, count);
                eg_add_tangent(g, own_d, g->gain, T0, 0, own, count);
                eg_add_scaled(gone, 1.0, own_d, block);
                eg_add_scaled(sum, 1.0, own, all);
            }
            for (node = 0; node < m; ++node)
                for (mode = 0; mode < m; ++mode) {
                    const double value = g->values[node * m + mode];
                    eg_add_scaled(theta + node * block, value, d + mode * block, block);
                    eg_add_scaled(w + node * block, value, x + mode * all, block);
                    eg_add_scaled(y + node * small, value, x + mode * all + block, small);
                }
        }
        /* the end of the step */
        memset(dq, 0, (size_t)block * sizeof *dq);
        eg_add_tangent(g, dq, 1.0, g->A + ((g->passes - 1) * m * g->steps + k) * turning, 0, q, count);
        eg_add_tangent(g, dq, 1.0, g->T + ((g->passes - 1) * m * g->steps + k) * turning, 0, theta + (m - 1) * block,
            count);
        memcpy(state, dq, (size_t)block * sizeof *state);
        eg_add_scaled(state + block, 1.0, w + (m - 1) * block, block);
        memset(state + 2 * block, 0, (size_t)block * sizeof *state);
        for (i = 0; i < m; ++i)
            eg_add_scaled(state + 2 * block, g->derivative[(m - 1) * m + i] / g->step, w + i * block, block);
        eg_add_scaled(state + 3 * block, 1.0, y + (m - 1) * small, small);
        memcpy(ends, state, (size_t)(width * count) * sizeof *ends);
        ends += width * count;
    }
    return g->steps;
}
