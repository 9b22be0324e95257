/* Factors of matrices that share the places of their nonzeros: the order of pivots is chosen once.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models. Pivots of least fill among large enough ones: Markowitz 1957; Duff, Erisman
 * and Reid, Direct Methods for Sparse Matrices (2017), chapter 7. Matrices are dense in memory, (n, n) row-major, and
 * eliminated at the places of the plan alone.
 */

/* Matrices below this size, and operations of a plan as a part of the dense ones, for which a plan does not pay. */
#define EG_SMALL 16
#define EG_WORTH 0.3
/* Smallest part of the largest entry of its column that a pivot may be, and the largest multiple of a pivot row, rows
 * scaled as in the sample, that a step may need. */
#define EG_PIVOT 0.05
#define EG_GROWTH 1e4
/* Steps whose nonzeros are looked at. */
#define EG_SAMPLES 6

/* A plan in the caller's memory. made: 0: not yet, 1: in use, -1: of no use. */
typedef struct eg_plan {
    long *made, *row, *column;     /* pivot k is S[row[k]][column[k]] */
    long *lower_at, *lower;        /* rows that pivot k changes, from lower_at[k] on */
    long *upper_at, *upper;        /* their changed columns */
    long *place;                   /* places of nonzeros of the matrix, place[0] of them behind the first */
    double *scale;                 /* of rows */
} eg_plan;

EG_SEEN long eomgen_plan_size(long n) { return 1 + 2 * n + 2 * (n + 1) + 3 * n * n + 1; }

static eg_plan eg_plan_in(long *memory, double *scale, long n)
{
    eg_plan plan;
    plan.made = memory;
    plan.row = plan.made + 1;
    plan.column = plan.row + n;
    plan.lower_at = plan.column + n;
    plan.upper_at = plan.lower_at + n + 1;
    plan.lower = plan.upper_at + n + 1;
    plan.upper = plan.lower + n * n;
    plan.place = plan.upper + n * n;
    plan.scale = scale;
    return plan;
}

/* Choose pivots for nonzeros, (n, n), by the numbers of a sample S, which is eliminated. counts: room for 3 n. */
static void eg_make_plan(eg_plan *plan, char *nonzero, double *S, long *counts, long n)
{
    long *rows = counts, *columns = counts + n, *done = counts + 2 * n; /* bit 0: row, bit 1: column */
    long i, j, k, places = 0, lower = 0, upper = 0;
    double operations = 0.0;
    *plan->made = -1;
    for (i = 0; i < n; ++i) {
        plan->scale[i] = eg_inverse_of_largest(S + i * n, 1, n);
        if (plan->scale[i] == 0.0)
            return;
        for (j = 0; j < n; ++j)
            S[i * n + j] *= plan->scale[i];
        rows[i] = columns[i] = done[i] = 0;
    }
    for (i = 0; i < n; ++i)
        for (j = 0; j < n; ++j)
            if (nonzero[i * n + j]) {
                plan->place[++places] = i * n + j;
                ++rows[i];
                ++columns[j];
            }
    plan->place[0] = places;
    for (k = 0; k < n; ++k) {
        long r = -1, c = -1;
        double least = 0.0, size = 0.0;
        for (j = 0; j < n; ++j) {
            double largest = 0.0;
            if (done[j] & 2)
                continue;
            for (i = 0; i < n; ++i)
                if (!(done[i] & 1) && fabs(S[i * n + j]) > largest)
                    largest = fabs(S[i * n + j]);
            for (i = 0; i < n && largest > 0.0; ++i) {
                const double own = fabs(S[i * n + j]), fill = (double)((rows[i] - 1) * (columns[j] - 1));
                if (!(done[i] & 1) && own >= EG_PIVOT * largest
                    && (r < 0 || fill < least || (fill == least && own > size))) {
                    least = fill;
                    size = own;
                    r = i;
                    c = j;
                }
            }
        }
        if (r < 0)
            return;
        plan->row[k] = r;
        plan->column[k] = c;
        done[r] |= 1;
        done[c] |= 2;
        plan->lower_at[k] = lower;
        plan->upper_at[k] = upper;
        for (j = 0; j < n; ++j)
            if (!(done[j] & 2) && nonzero[r * n + j]) {
                plan->upper[upper++] = j;
                --columns[j];
            }
        for (i = 0; i < n; ++i) {
            double factor;
            if ((done[i] & 1) || !nonzero[i * n + c])
                continue;
            plan->lower[lower++] = i;
            --rows[i];
            factor = S[i * n + c] / S[r * n + c];
            for (j = plan->upper_at[k]; j < upper; ++j) {
                const long place = i * n + plan->upper[j];
                S[place] -= factor * S[r * n + plan->upper[j]];
                if (!nonzero[place]) {
                    nonzero[place] = 1;
                    ++rows[i];
                    ++columns[plan->upper[j]];
                }
            }
        }
        operations += (double)(lower - plan->lower_at[k]) * (double)(upper - plan->upper_at[k]);
    }
    plan->lower_at[n] = lower;
    plan->upper_at[n] = upper;
    if (operations < EG_WORTH * (double)n * (double)n * (double)n / 3.0)
        *plan->made = 1;
}

/* Factor S by a plan; 0: it has other nonzeros or too small pivots, and is spoilt. */
static int eg_factor_planned(const eg_plan *plan, double *S, long n)
{
    long i, j, k, all = 0, own = 0;
    for (i = 0; i < n * n; ++i)
        all += S[i] != 0.0;
    for (k = 1; k <= plan->place[0]; ++k)
        own += S[plan->place[k]] != 0.0;
    if (all != own)
        return 0;
    for (k = 0; k < n; ++k) {
        const double *from = S + plan->row[k] * n;
        const double inverse = 1.0 / from[plan->column[k]], bound = EG_GROWTH * plan->scale[plan->row[k]];
        const long *columns = plan->upper + plan->upper_at[k], count = plan->upper_at[k + 1] - plan->upper_at[k];
        if (!(fabs(inverse) <= 1e300))
            return 0;
        for (i = plan->lower_at[k]; i < plan->lower_at[k + 1]; ++i) {
            const long r = plan->lower[i];
            double *to = S + r * n;
            const double factor = to[plan->column[k]] * inverse;
            if (!(fabs(factor) * plan->scale[r] <= bound))
                return 0;
            to[plan->column[k]] = factor;
            for (j = 0; j < count; ++j)
                to[columns[j]] -= factor * from[columns[j]];
        }
    }
    return 1;
}

/* X := S^-1 X, (n, count); room: as many numbers. */
static void eg_solve_planned(const eg_plan *plan, const double *S, long n, double *X, long count, double *room)
{
    long i, j, k;
    for (k = 0; k < n; ++k)
        for (i = plan->lower_at[k]; i < plan->lower_at[k + 1]; ++i) {
            const long r = plan->lower[i];
            eg_add_scaled(X + r * count, -S[r * n + plan->column[k]], X + plan->row[k] * count, count);
        }
    for (k = n - 1; k >= 0; --k) {
        const double *from = S + plan->row[k] * n;
        double *x = room + plan->column[k] * count;
        memcpy(x, X + plan->row[k] * count, (size_t)count * sizeof *x);
        for (j = plan->upper_at[k]; j < plan->upper_at[k + 1]; ++j)
            eg_add_scaled(x, -from[plan->upper[j]], room + plan->upper[j] * count, count);
        eg_multiply(x, 1.0 / from[plan->column[k]], count);
    }
    memcpy(X, room, (size_t)(n * count) * sizeof *X);
}

/* X := S^-T X. */
static void eg_solve_planned_transposed(const eg_plan *plan, const double *S, long n, double *X, long count,
    double *room)
{
    long i, j, k;
    for (k = 0; k < n; ++k) {
        const double *from = S + plan->row[k] * n;
        double *x = room + plan->row[k] * count;
        memcpy(x, X + plan->column[k] * count, (size_t)count * sizeof *x);
        eg_multiply(x, 1.0 / from[plan->column[k]], count);
        for (j = plan->upper_at[k]; j < plan->upper_at[k + 1]; ++j)
            eg_add_scaled(X + plan->upper[j] * count, -from[plan->upper[j]], x, count);
    }
    for (k = n - 1; k >= 0; --k)
        for (i = plan->lower_at[k]; i < plan->lower_at[k + 1]; ++i) {
            const long r = plan->lower[i];
            eg_add_scaled(room + plan->row[k] * count, -S[r * n + plan->column[k]], room + r * count, count);
        }
    memcpy(X, room, (size_t)(n * count) * sizeof *X);
}
