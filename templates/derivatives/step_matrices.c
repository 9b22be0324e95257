/* Matrices of steps by their plan, EG_LANES steps side by side, and products of their blocks with directions.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models.
 */

/* Values of EG_LANES steps: those at numbers[w] for lane w. */
static void eg_gather(const eg_steps *given, const eg_plan *plan, const long *numbers, double *values)
{
    int b, e, w, p;
    for (w = 0; w < EG_LANES; ++w)
        values[w] = 1.0;
    for (b = 0; b < EG_BLOCKS; ++b) {
        const eg_block x = given->block[b];
        double *to = values + (long)plan->first[b] * EG_LANES;
        const double *from[EG_LANES];
        for (w = 0; w < EG_LANES; ++w)
            from[w] = x.x + numbers[w] * x.step;
        for (e = 0; e < plan->count[b]; ++e, to += EG_LANES) {
            const long place = plan->at[b][2 * e] * x.row + plan->at[b][2 * e + 1] * x.column;
            for (w = 0; w < EG_LANES; ++w)
                to[w] = from[w][place];
        }
    }
    {
        const long known = plan->products ? plan->product[0] : plan->values;
        memset(values + known * EG_LANES, 0, (size_t)((plan->values - known) * EG_LANES) * sizeof *values);
    }
    for (p = 0; p < plan->products;) { /* sums of products one after another, in registers */
        const int *of = plan->product + 3 * p, into = of[0];
        double total[EG_LANES] = { 0.0 };
        for (; p < plan->products && of[0] == into; ++p, of += 3)
            eg_lanes_add(total, 1.0, values + (long)of[1] * EG_LANES, values + (long)of[2] * EG_LANES);
        for (w = 0; w < EG_LANES; ++w)
            values[(long)into * EG_LANES + w] += total[w];
    }
}

static void eg_coefficients_of(const eg_gains *g, double *c)
{
    c[EG_ONE] = 1.0;
    c[EG_OF_VDOT] = g->to_vdot;
    c[EG_OF_V] = g->h * g->gamma;
    c[EG_OF_Q] = g->h * g->h * g->beta;
    c[EG_OF_ETA] = -g->h;
    c[EG_OF_Z] = g->h * g->zgamma;
    c[EG_OF_ZDOT] = g->to_zdot;
}

/* Entries of the matrices of EG_LANES steps; the first value is 1. */
static void eg_matrices(const eg_plan *plan, const double *c, const double *values, double *S)
{
    int k;
    memset(S, 0, (size_t)plan->entries * EG_LANES * sizeof *S);
    for (k = 0; k < plan->sums; ++k) {
        const int *of = plan->sum + 3 * k;
        eg_lanes_add(S + (long)of[0] * EG_LANES, c[of[2]], values + (long)of[1] * EG_LANES, values);
    }
}

/* The matrix of the step of one lane, (n, n). */
static void eg_dense_matrix(const eg_plan *plan, const double *c, const double *values, int lane, long n, double *S)
{
    int k;
    memset(S, 0, (size_t)(n * n) * sizeof *S);
    for (k = 0; k < plan->sums; ++k) {
        const int *of = plan->sum + 3 * k;
        S[plan->place[of[0]]] += c[of[2]] * values[(long)of[1] * EG_LANES + lane];
    }
}

/* Y += s X D for a block of the step of one lane. */
static void eg_add_block(const eg_plan *plan, int block, const double *values, double s, const double *D, double *Y,
    long count)
{
    const double *x = values + (long)plan->first[block] * EG_LANES;
    const int *at = plan->at[block];
    int e;
    if (count == 1)
        for (e = 0; e < plan->count[block]; ++e)
            Y[at[2 * e]] += s * x[(long)e * EG_LANES] * D[at[2 * e + 1]];
    else
        for (e = 0; e < plan->count[block]; ++e)
            eg_add_scaled(Y + at[2 * e] * count, s * x[(long)e * EG_LANES], D + at[2 * e + 1] * count, count);
}

/* Y += s X^T D. */
static void eg_add_block_transposed(const eg_plan *plan, int block, const double *values, double s, const double *D,
    double *Y, long count)
{
    const double *x = values + (long)plan->first[block] * EG_LANES;
    const int *at = plan->at[block];
    int e;
    if (count == 1)
        for (e = 0; e < plan->count[block]; ++e)
            Y[at[2 * e + 1]] += s * x[(long)e * EG_LANES] * D[at[2 * e]];
    else
        for (e = 0; e < plan->count[block]; ++e)
            eg_add_scaled(Y + at[2 * e + 1] * count, s * x[(long)e * EG_LANES], D + at[2 * e] * count, count);
}

/* Y += s x D, x being the diagonal of NW. */
static void eg_add_diagonal(const eg_plan *plan, const double *values, double s, const double *D, double *Y, long count)
{
    const double *x = values + (long)plan->first[EG_NW] * EG_LANES;
    const int *at = plan->at[EG_NW];
    int e;
    for (e = 0; e < plan->count[EG_NW]; ++e)
        eg_add_scaled(Y + at[2 * e] * count, s * x[(long)e * EG_LANES], D + at[2 * e] * count, count);
}
