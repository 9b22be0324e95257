/* Adjoints through steps of time-discontinuous Galerkin methods: the statements of tangents transposed, from the last.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models. Griewank and Walther, Evaluating Derivatives (2008), chapter 4.
 */

/* Derivatives of functionals in the values of a node. */
typedef struct eg_taken {
    eg_number *q, *v, *a, *z; /* (size, functionals); a: NULL if it stays 0 */
} eg_taken;

/* Adds the product of multipliers (rows, functionals) with the partials of e at a point, to a node. */
static void eg_pull_equations(const eg_passes *g, long point, long k, long rows, const eg_number *multipliers,
    eg_taken taken)
{
    const long nv = g->nv, count = g->directions, at = (point * g->steps + k) * eg_rows(g);
    eg_add_transposed(taken.q, 1.0, g->Jq + at * nv, rows, nv, multipliers, count);
    eg_add_transposed(taken.v, 1.0, g->Jv + at * nv, rows, nv, multipliers, count);
    if (taken.a)
        eg_add_transposed(taken.a, 1.0, g->Ja + at * nv, rows, nv, multipliers, count);
    eg_add_transposed(taken.z, 1.0, g->Jz + at * g->nz, rows, g->nz, multipliers, count);
}

/* Takes a solution of S, whose derivatives are x, back: x becomes multipliers; d, the derivatives in its theta, become
 * the ones in u. T_0 moves with v. */
static void eg_pull_pair(const eg_passes *g, long pair, long k, eg_number *x, eg_number *d, eg_number *of_v,
    eg_number *room)
{
    const long nv = g->nv, n = eg_rows(g), turning = eg_turning(g), count = g->directions, block = nv * count;
    memset(room, 0, (size_t)block * sizeof *room);
    eg_add_tangent(g, room, g->gain, g->T0 + k * turning, 1, d, count);
    eg_add_scaled(x, 1.0, room, block);
    eg_solve_step_transposed(g, k, x, count);
    eg_add_transposed(d, -g->gain, g->Jq0 + k * n * nv, n, nv, x, count);
    eg_add_turned(g, of_v, 1.0, g->T0_along + (pair * g->steps + k) * turning, 1, d, count);
    memset(room, 0, (size_t)block * sizeof *room);
    eg_add_tangent(g, room, 1.0, g->T0 + k * turning, 1, d, count);
    memcpy(d, room, (size_t)block * sizeof *d);
}

/* Takes the product of multipliers of the pairs of a step, (pairs, rows, functionals), with the change of e' by its
 * start: pair by pair, or row by row of e if that is less. Returns a status of the call. */
static int eg_bend_step(const eg_passes *g, const eg_curvature *by, long k, const eg_number *multipliers,
    eg_number *state, eg_number *rest)
{
    const long nv = g->nv, n = eg_rows(g), width = eg_width(g), count = g->directions;
    const long pairs = eg_first_pair(g, g->passes), samples = pairs < n ? pairs : n;
    eg_number *weights = by->room, *moved = weights + samples * by->weighted, *found = moved + samples * by->moved,
        *own = found + samples * by->moved;
    double *results[1];
    long functional, pair, s, i;
    results[0] = (double *)found;
    by->input[by->weights] = (const double *)weights;
    by->input[by->direction] = (const double *)moved;
    for (functional = 0; functional < count; ++functional) {
        memset(weights, 0, (size_t)(samples * (by->weighted + by->moved)) * sizeof *weights);
        for (pair = 0; pair < pairs; ++pair) {
            const eg_number *xi = g->along + (pair * g->steps + k) * width;
            if (samples < n)
                memcpy(moved + pair * by->moved, xi, (size_t)width * sizeof *moved);
            else
                for (s = 0; s < n; ++s)
                    eg_add_scaled(moved + s * by->moved, multipliers[(pair * n + s) * count + functional], xi, width);
        }
        for (s = 0; s < samples; ++s) {
            for (i = 0; i < n; ++i)
                own[i] = samples < n ? multipliers[(s * n + i) * count + functional] : i == s ? 1.0 : 0.0;
            eg_weigh(g, -1.0, own, weights + s * by->weighted);
        }
        if (by->call(by->function, samples, by->input, by->strides, results))
            return 1;
        for (s = 0; s < samples; ++s) {
            const eg_number *gradient = found + s * by->moved;
            for (i = 0; i < width; ++i)
                state[i * count + functional] += gradient[i];
            for (i = width; i < by->moved; ++i)
                rest[(i - width) * count + functional] += gradient[i];
            if (!g->turns)
                continue;
            memset(own, 0, (size_t)nv * sizeof *own);
            for (i = 0; i < n; ++i) {
                const eg_number multiplier = samples < n ? multipliers[(s * n + i) * count + functional]
                    : i == s ? 1.0 : 0.0;
                eg_add_scaled(own, multiplier, g->Jq0 + (k * n + i) * nv, nv);
            }
            eg_add_brackets(g, 1.0, own, moved + s * by->moved, state + functional, count);
        }
    }
    return 0;
}

EG_SEEN long eomgen_passes_adjoint_room(const eg_passes *g)
{
    const long nv = g->nv, n = eg_rows(g), pairs = eg_first_pair(g, g->passes);
    return ((4 * g->nodes + 6) * nv + (2 * g->nodes + pairs + 1) * n + (g->nodes + 1) * g->nz) * g->directions;
}

/* Adjoints through the steps, from the last to the first. state, in and out, (3 nv + nz, directions): derivatives of
 * functionals in q, v, a, z at the end of the last step, without their direct part of that row; then at the start
 * of the first. direct, of each step, (3 nv + nz, directions): the direct part of functionals at its end. multipliers:
 * derivatives in e at the points, (points, steps, rows, directions). rest, of each step,
 * (moved - (3 nv + nz), directions): the part of e'' at its start in parameters and inputs. Returns the number of
 * steps, or -1 if a function of the model failed. */
EG_SEEN long eomgen_passes_adjoints(const eg_passes *g, const eg_curvature *by, const eg_number *direct,
    eg_number *state, eg_number *multipliers, eg_number *rest, eg_number *room)
{
    const long nv = g->nv, nz = g->nz, n = eg_rows(g), m = g->nodes, width = eg_width(g), count = g->directions;
    const long block = nv * count, small = nz * count, all = n * count, turning = eg_turning(g);
    const long pairs = eg_first_pair(g, g->passes), tail = (by->moved - width) * count;
    eg_number *q = state, *v = q + block, *a = v + block, *z = a + block;
    eg_number *theta = room, *w = theta + m * block, *y = w + m * block, *rates = y + m * small,
        *d = rates + m * block, *x = d + m * block, *f = x + m * all, *of_pairs = f + m * all,
        *sum = of_pairs + pairs * all, *gone = sum + all, *turned = gone + block, *dq = turned + block,
        *dv = dq + block, *da = dv + block, *dz = da + block, *temporary = dz + small;
    long k, pass, node, mode, i;
    eg_move_inputs(by, g->steps);
    for (k = g->steps - 1; k >= 0; --k) {
        const long end = (g->passes - 1) * m * g->steps + k;
        eg_move_inputs(by, -1);
        eg_add_scaled(state, 1.0, direct + k * width * count, width * count);
        /* the end of the step */
        memset(theta, 0, (size_t)(m * (2 * block + small)) * sizeof *theta);
        eg_add_tangent(g, theta + (m - 1) * block, 1.0, g->T + end * turning, 1, q, count);
        memcpy(w + (m - 1) * block, v, (size_t)block * sizeof *w);
        memcpy(y + (m - 1) * small, z, (size_t)small * sizeof *y);
        for (i = 0; i < m; ++i)
            eg_add_scaled(w + i * block, g->derivative[(m - 1) * m + i] / g->step, a, block);
        memset(a, 0, (size_t)block * sizeof *a);
        memset(temporary, 0, (size_t)block * sizeof *temporary);
        eg_add_tangent(g, temporary, 1.0, g->A + end * turning, 1, q, count);
        memcpy(q, temporary, (size_t)block * sizeof *q);
        for (pass = g->passes - 1; pass >= 0; --pass) {
            const double *integral = pass ? g->integral : g->first_integral;
            const long pair = eg_first_pair(g, pass), point = eg_first_point(g, pass);
            const long modes = pair + (pass && g->refined ? 2 * m : 0);
            memset(d, 0, (size_t)(m * (block + all)) * sizeof *d);
            for (mode = 0; mode < m; ++mode)
                for (node = 0; node < m; ++node) {
                    const double value = g->values[node * m + mode];
                    eg_add_scaled(d + mode * block, value, theta + node * block, block);
                    eg_add_scaled(x + mode * all, value, w + node * block, block);
                    eg_add_scaled(x + mode * all + block, value, y + node * small, small);
                }
            /* multipliers of this and later modes, and derivatives in their u */
            memset(sum, 0, (size_t)(all + block) * sizeof *sum);
            memset(rates, 0, (size_t)(m * block) * sizeof *rates);
            memset(f, 0, (size_t)(m * all) * sizeof *f);
            for (mode = m - 1; mode >= 0; --mode) {
                eg_number *own = x + mode * all, *own_d = d + mode * block;
                eg_add_transposed(own, -1.0, g->Ja0 + k * n * nv, n, nv, sum, count);
                eg_add_scaled(own + block, -1.0, sum + block, small);
                eg_add_scaled(own_d, -1.0, gone, block);
                eg_pull_pair(g, modes + mode, k, own, own_d, v, temporary);
                memcpy(of_pairs + (modes + mode) * all, own, (size_t)all * sizeof *own);
                eg_add_scaled(sum, 1.0, own, all);
                eg_add_scaled(gone, 1.0, own_d, block);
                for (node = 0; node < m; ++node) {
                    const double weight = g->step * integral[mode * m + node], gone_by = -g->modes[mode * m + node];
                    eg_add_scaled(f + node * all, weight, sum, all);
                    eg_add_scaled(rates + node * block, weight, gone, block);
                    if (!pass)
                        continue;
                    eg_add_scaled(theta + node * block, gone_by, gone, block);
                    eg_add_scaled(y + node * small, gone_by, sum + block, small);
                }
            }
            for (node = 0; node < m; ++node) {
                const long place = ((pass - 1) * m + node) * g->steps + k;
                const long behind = pass && g->refined ? point + m + node : point + (pass ? node : node % g->first);
                const eg_taken taken = { pass ? dq : q, pass ? dv : v, pass ? da : NULL, pass ? dz : z };
                eg_number *own = multipliers + (behind * g->steps + k) * all, *rate = rates + node * block;
                if (!pass) {
                    eg_add_scaled(v, 1.0, rate, block);
                    if (node >= g->first) /* the same point again */
                        eg_add_scaled(f, 1.0, f + node * all, all);
                    if (g->first == 1 && node < m - 1)
                        continue;
                    memset(own, 0, (size_t)all * sizeof *own);
                    eg_add_scaled(own, -1.0, g->first == 1 ? f : f + node * all, all);
                    eg_pull_equations(g, behind, k, n, own, taken);
                    continue;
                }
                memset(dq, 0, (size_t)(3 * block + small) * sizeof *dq);
                memset(own, 0, (size_t)all * sizeof *own);
                eg_add_scaled(own, -1.0, f + node * all, all);
                eg_pull_equations(g, behind, k, n, own, taken);
                if (g->refined) {
                    eg_number *solved = of_pairs + (pair + node) * all, *product = solved + m * all;
                    memset(solved, 0, (size_t)all * sizeof *solved);
                    eg_add_scaled(solved, -1.0, da, block);
                    eg_add_transposed(solved, 1.0, g->Ja0 + k * n * nv, nv, nv, own, count);
                    memset(product, 0, (size_t)all * sizeof *product);
                    eg_add_scaled(product, -1.0, own, block);
                    memset(turned, 0, (size_t)block * sizeof *turned);
                    eg_pull_pair(g, pair + node, k, solved, turned, v, temporary);
                    own = multipliers + ((point + node) * g->steps + k) * all;
                    memset(own, 0, (size_t)all * sizeof *own);
                    memcpy(own, solved, (size_t)block * sizeof *own);
                    eg_pull_equations(g, point + node, k, nv, own, taken);
                }
                eg_add_tangent(g, dv, 1.0, g->rate + place * turning, 1, rate, count);
                eg_add_turned(g, theta + node * block, 1.0, g->rate_along + place * turning, 1, rate, count);
                eg_add_tangent(g, theta + node * block, 1.0, g->T + place * turning, 1, dq, count);
                eg_add_tangent(g, q, 1.0, g->A + place * turning, 1, dq, count);
                eg_add_scaled(v, 1.0, dv, block);
                eg_add_scaled(w + node * block, 1.0, dv, block);
                eg_add_scaled(z, 1.0, dz, small);
                eg_add_scaled(y + node * small, 1.0, dz, small);
                for (i = 0; i < m; ++i)
                    eg_add_scaled(w + i * block, g->derivative[node * m + i] / g->step, da, block);
            }
        }
        memset(rest + k * tail, 0, (size_t)tail * sizeof *rest);
        if (eg_bend_step(g, by, k, of_pairs, state, rest + k * tail))
            return -1;
    }
    return g->steps;
}
