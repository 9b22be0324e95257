/* Multipliers of velocities in steps, and the forces of constraints that belong to the multipliers.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models.
 */

static int eg_vanishes(const double *x)
{
    int w, all = 1;
    for (w = 0; w < EG_LANES; ++w)
        all = all && x[w] == 0.0;
    return all;
}

/* Multipliers eta of velocities in steps: (B W B^T) eta = B moved. B of step k begins at B + k stride; W, (nv), is the same
 * for all steps or, with w_stride = nv, each step's own. moved: (nv) of each step. Fills G = B W (nh, nv), eta (nh) and
 * B^T eta (nv) of each step. room: (nh nh + 2 nh nv + 2 nh + nv) EG_LANES. Returns the number of the first step without a
 * solution, else the number of steps. */
EG_SEEN long eomgen_step_reactions(long steps, long nv, long nh, const double *B, long stride, const double *W,
    long w_stride, const double *moved, double *G, double *eta, double *reaction, double *room)
{
    double *S = room, *X = S + nh * nh * EG_LANES, *Y = X + nh * nv * EG_LANES, *x = Y + nh * nv * EG_LANES,
        *r = x + nh * EG_LANES;
    long *some = (long *)(void *)(r + nv * EG_LANES); /* of a row or column the places that are not zero */
    long k, i, j, t, w, m, n;
    for (k = 0; k < steps; k += EG_LANES) {
        const long count = k + EG_LANES <= steps ? EG_LANES : steps - k;
        for (w = 0; w < EG_LANES; ++w) {
            const long step = k + (w < count ? w : count - 1);
            const double *from = B + step * stride, *of_W = W + step * w_stride;
            for (i = 0; i < nh; ++i)
                for (j = 0; j < nv; ++j) {
                    X[(i * nv + j) * EG_LANES + w] = from[i * nv + j];
                    Y[(i * nv + j) * EG_LANES + w] = G[step * nh * nv + i * nv + j] = from[i * nv + j] * of_W[j];
                }
            for (j = 0; j < nv; ++j)
                r[j * EG_LANES + w] = moved[step * nv + j];
        }
        memset(S, 0, (size_t)(nh * nh * EG_LANES) * sizeof *S);
        memset(x, 0, (size_t)(nh * EG_LANES) * sizeof *x);
        for (t = 0; t < nv; ++t) {
            for (i = 0, n = 0; i < nh; ++i)
                if (!eg_vanishes(Y + (i * nv + t) * EG_LANES))
                    some[n++] = i;
            for (m = 0; m < n; ++m) {
                const double *y = Y + (some[m] * nv + t) * EG_LANES;
                for (j = m; j < n; ++j)
                    eg_lanes_add(S + (some[m] * nh + some[j]) * EG_LANES, 1.0, y, X + (some[j] * nv + t) * EG_LANES);
                eg_lanes_add(x + some[m] * EG_LANES, 1.0, X + (some[m] * nv + t) * EG_LANES, r + t * EG_LANES);
            }
        }
        for (i = 0; i < nh; ++i) { /* rows of the upper factor, with the inverses of their pivots */
            double *pivot = S + (i * nh + i) * EG_LANES;
            for (w = 0; w < count; ++w)
                if (!(pivot[w] > 0.0))
                    return k + w;
            for (w = 0; w < EG_LANES; ++w)
                pivot[w] = 1.0 / pivot[w];
            for (j = i + 1, n = 0; j < nh; ++j)
                if (!eg_vanishes(S + (i * nh + j) * EG_LANES))
                    some[n++] = j;
            for (m = 0; m < n; ++m) {
                double factor[EG_LANES];
                for (w = 0; w < EG_LANES; ++w)
                    factor[w] = S[(i * nh + some[m]) * EG_LANES + w] * pivot[w];
                for (t = m; t < n; ++t)
                    eg_lanes_add(S + (some[m] * nh + some[t]) * EG_LANES, -1.0, factor,
                        S + (i * nh + some[t]) * EG_LANES);
                eg_lanes_add(x + some[m] * EG_LANES, -1.0, factor, x + i * EG_LANES);
            }
        }
        for (i = nh - 1; i >= 0; --i) {
            for (j = i + 1; j < nh; ++j)
                eg_lanes_add(x + i * EG_LANES, -1.0, S + (i * nh + j) * EG_LANES, x + j * EG_LANES);
            for (w = 0; w < EG_LANES; ++w)
                x[i * EG_LANES + w] *= S[(i * nh + i) * EG_LANES + w];
        }
        memset(r, 0, (size_t)(nv * EG_LANES) * sizeof *r);
        for (i = 0; i < nh; ++i)
            for (j = 0; j < nv; ++j)
                eg_lanes_add(r + j * EG_LANES, 1.0, X + (i * nv + j) * EG_LANES, x + i * EG_LANES);
        for (w = 0; w < count; ++w) {
            for (i = 0; i < nh; ++i)
                eta[(k + w) * nh + i] = x[i * EG_LANES + w];
            for (j = 0; j < nv; ++j)
                reaction[(k + w) * nv + j] = r[j * EG_LANES + w];
        }
    }
    return steps;
}
