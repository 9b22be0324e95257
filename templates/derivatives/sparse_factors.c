/* Factors of matrices that share the places of their nonzeros: the order of pivots is chosen once, and EG_LANES matrices
 * are eliminated side by side.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models. Pivots of least fill among large enough ones: Markowitz 1957; Duff, Erisman
 * and Reid, Direct Methods for Sparse Matrices (2017), chapter 7. A number of EG_LANES matrices is EG_LANES doubles.
 */

#define EG_LANES 8
/* Smallest part of the largest entry of its column that a pivot may be in all matrices of the sample, and the largest
 * multiple of a pivot row, rows scaled as in the sample, that a step may need: 1e4 costs two digits of a run's
 * derivatives. */
#define EG_PIVOT 0.05
#define EG_GROWTH 1e2

#if defined(EG_VECTORS)
typedef double eg_lanes __attribute__((vector_size(8 * EG_LANES), aligned(8), may_alias));
typedef long long eg_bits __attribute__((vector_size(8 * EG_LANES), aligned(8), may_alias));
#endif

/* fine: (EG_LANES), stays -1 where numbers are of at most this size, else becomes 0. */
static inline void eg_lanes_check(const double *x, double bound, long long *fine)
{
#if defined(EG_VECTORS)
    const eg_lanes value = *(const eg_lanes *)x;
    *(eg_bits *)fine &= (value <= bound) & (value >= -bound);
#else
    int w;
    for (w = 0; w < EG_LANES; ++w)
        fine[w] &= fabs(x[w]) <= bound ? -1 : 0;
#endif
}

/* y = a b in all lanes. */
static inline void eg_lanes_times(double *y, const double *a, const double *b)
{
#if defined(EG_VECTORS)
    *(eg_lanes *)y = *(const eg_lanes *)a * *(const eg_lanes *)b;
#else
    int w;
    for (w = 0; w < EG_LANES; ++w)
        y[w] = a[w] * b[w];
#endif
}

/* y += s a b in all lanes. */
static inline void eg_lanes_add(double *y, double s, const double *a, const double *b)
{
#if defined(EG_VECTORS)
    *(eg_lanes *)y += s * *(const eg_lanes *)a * *(const eg_lanes *)b;
#else
    int w;
    for (w = 0; w < EG_LANES; ++w)
        y[w] += s * a[w] * b[w];
#endif
}

/* Integers of the caller, handed out from the front; full: more were asked for than there are. */
typedef struct eg_arena {
    int *memory;
    long used, capacity;
    int full;
} eg_arena;

static int *eg_take(eg_arena *arena, long count)
{
    int *result = arena->memory + arena->used;
    if (arena->full || arena->used + count > arena->capacity) {
        arena->full = 1;
        return 0;
    }
    arena->used += count;
    return result;
}

/* Order of an elimination: pivot k is the entry pivot[k], in row[k] and column[k]. */
typedef struct eg_order {
    int n, entries;              /* entries: nonzeros, those of fill included */
    const int *row, *column, *pivot;
    const int *lower_at, *lower, *lower_entry; /* rows that pivot k changes, from lower_at[k] on, and their factors */
    const int *upper_at, *upper, *upper_entry; /* their changed columns, and the numbers of the pivot row there */
    const int *changed;          /* entries in the order of their changes */
    const double *scale;         /* of rows */
} eg_order;

/* The least part that a pivot is of the largest entries of its column, over the EG_LANES matrices of a sample. */
static double eg_least_part(const double *pivot, const double *largest)
{
    double least = 1.0;
    int w;
    for (w = 0; w < EG_LANES; ++w)
        if (!(fabs(pivot[w]) > least * largest[w]))
            least = largest[w] > 0.0 ? fabs(pivot[w]) / largest[w] : 0.0;
    return least;
}

/* Choose pivots for nonzeros, (n, n), to which fill is added, by the numbers S, (n, n, EG_LANES), of a sample, whose
 * matrices are eliminated. entry: room for (n, n), numbers of the entries afterwards; counts: room for 3 n. 0: a matrix
 * of the sample has no pivot where the others have one, or no room. */
static int eg_choose_order(eg_order *order, eg_arena *arena, char *nonzero, double *S, double *scale, int *entry,
    int *counts, int n)
{
    int *rows = counts, *columns = counts + n, *done = counts + 2 * n; /* bit 0: row, bit 1: column */
    int *row = eg_take(arena, n), *column = eg_take(arena, n), *pivot = eg_take(arena, n);
    int *lower_at = eg_take(arena, n + 1), *upper_at = eg_take(arena, n + 1), *lower, *upper, *lower_entry, *upper_entry,
        *changed;
    const long width = (long)n * EG_LANES;
    int i, j, k, w, entries = 0, count = 0, lowers = 0, uppers = 0, changes = 0;
    if (arena->full)
        return 0;
    for (i = 0; i < n; ++i) {
        scale[i] = eg_inverse_of_largest(S + i * width, 1, width);
        if (scale[i] == 0.0)
            return 0;
        eg_multiply(S + i * width, scale[i], width);
        rows[i] = columns[i] = done[i] = 0;
    }
    for (i = 0; i < n; ++i)
        for (j = 0; j < n; ++j)
            if (nonzero[i * n + j]) {
                ++rows[i];
                ++columns[j];
            }
    for (k = 0; k < n; ++k) {
        int r = -1, c = -1, fewest = n + 1, own_lower = 0, own_upper = 0;
        double least = 0.0, size = 0.0;
        const double *own_row;
        for (j = 0; j < n; ++j)
            if (!(done[j] & 2) && columns[j] < fewest)
                fewest = columns[j];
        for (j = 0; j < n; ++j) { /* in the shortest columns */
            double largest[EG_LANES] = { 0.0 };
            if ((done[j] & 2) || columns[j] > fewest + 1)
                continue;
            for (i = 0; i < n; ++i)
                for (w = 0; w < EG_LANES && nonzero[i * n + j] && !(done[i] & 1); ++w) {
                    const double entry_size = fabs(S[i * width + j * EG_LANES + w]);
                    largest[w] = entry_size > largest[w] ? entry_size : largest[w];
                }
            for (i = 0; i < n; ++i) {
                double fill, part;
                int fine;
                if ((done[i] & 1) || !nonzero[i * n + j])
                    continue;
                part = eg_least_part(S + i * width + j * EG_LANES, largest);
                fill = (double)((rows[i] - 1) * (columns[j] - 1));
                fine = part >= EG_PIVOT;
                if (part > 0.0
                    && (r < 0 || (fine && size < EG_PIVOT) || (fine && (fill < least || (fill == least && part > size)))
                        || (!fine && part > size))) {
                    least = fill;
                    size = part;
                    r = i;
                    c = j;
                }
            }
        }
        if (r < 0)
            return 0;
        row[k] = r;
        column[k] = c;
        done[r] |= 1;
        done[c] |= 2;
        for (j = 0; j < n; ++j)
            if (!(done[j] & 2) && nonzero[r * n + j]) {
                ++own_upper;
                --columns[j];
            }
        own_row = S + r * width;
        for (i = 0; i < n; ++i) {
            double factor[EG_LANES], *changed_row = S + i * width;
            if ((done[i] & 1) || !nonzero[i * n + c])
                continue;
            ++own_lower;
            --rows[i];
            for (w = 0; w < EG_LANES; ++w)
                factor[w] = changed_row[c * EG_LANES + w] / own_row[c * EG_LANES + w];
            for (j = 0; j < n; ++j) {
                if ((done[j] & 2) || !nonzero[r * n + j])
                    continue;
                eg_lanes_add(changed_row + j * EG_LANES, -1.0, factor, own_row + j * EG_LANES);
                if (!nonzero[i * n + j]) {
                    nonzero[i * n + j] = 1;
                    ++rows[i];
                    ++columns[j];
                }
            }
        }
        lowers += own_lower;
        uppers += own_upper;
        changes += own_lower * own_upper;
    }
    lower = eg_take(arena, lowers);
    lower_entry = eg_take(arena, lowers);
    upper = eg_take(arena, uppers);
    upper_entry = eg_take(arena, uppers);
    changed = eg_take(arena, changes);
    if (arena->full)
        return 0;
    for (i = 0; i < n * n; ++i)
        entry[i] = nonzero[i] ? entries++ : -1;
    memset(done, 0, (size_t)n * sizeof *done);
    lowers = uppers = changes = 0;
    for (k = 0; k < n; ++k) {
        const int r = row[k], c = column[k];
        done[r] |= 1;
        done[c] |= 2;
        pivot[k] = entry[r * n + c];
        lower_at[k] = lowers;
        upper_at[k] = uppers;
        for (j = 0; j < n; ++j)
            if (!(done[j] & 2) && entry[r * n + j] >= 0) {
                upper[uppers] = j;
                upper_entry[uppers++] = entry[r * n + j];
            }
        for (i = 0; i < n; ++i) {
            if ((done[i] & 1) || entry[i * n + c] < 0)
                continue;
            lower[lowers] = i;
            lower_entry[lowers++] = entry[i * n + c];
            for (count = upper_at[k]; count < uppers; ++count)
                changed[changes++] = entry[i * n + upper[count]];
        }
    }
    lower_at[n] = lowers;
    upper_at[n] = uppers;
    order->n = n;
    order->entries = entries;
    order->row = row;
    order->column = column;
    order->pivot = pivot;
    order->lower_at = lower_at;
    order->lower = lower;
    order->lower_entry = lower_entry;
    order->upper_at = upper_at;
    order->upper = upper;
    order->upper_entry = upper_entry;
    order->changed = changed;
    order->scale = scale;
    return 1;
}

/* Factor EG_LANES matrices with entries S; fine: (EG_LANES), 0 for those with too small pivots, else -1. Entries of pivots
 * become their inverses. */
static void eg_factor_lanes(const eg_order *order, double *S, long long *fine)
{
    const int *changed = order->changed;
    int k, i, j, w;
    for (w = 0; w < EG_LANES; ++w)
        fine[w] = -1;
    for (k = 0; k < order->n; ++k) {
        double *pivot = S + (long)order->pivot[k] * EG_LANES;
        const int *upper = order->upper_entry + order->upper_at[k], count = order->upper_at[k + 1] - order->upper_at[k];
        const double bound = EG_GROWTH * order->scale[order->row[k]];
        for (w = 0; w < EG_LANES; ++w)
            pivot[w] = 1.0 / pivot[w];
        eg_lanes_check(pivot, 1e300, fine);
        for (i = order->lower_at[k]; i < order->lower_at[k + 1]; ++i) {
            double *factor = S + (long)order->lower_entry[i] * EG_LANES;
            eg_lanes_times(factor, factor, pivot);
            eg_lanes_check(factor, bound / order->scale[order->lower[i]], fine);
            for (j = 0; j < count; ++j)
                eg_lanes_add(S + (long)*changed++ * EG_LANES, -1.0, factor, S + (long)upper[j] * EG_LANES);
        }
    }
}

/* X := S^-1 X, (n, count), S being the entries of one lane; room: as many numbers. */
static void eg_solve_lane(const eg_order *order, const double *S, double *X, long count, double *room)
{
    const int n = order->n;
    int i, j, k;
    if (count == 1) {
        for (k = 0; k < n; ++k) {
            const double x = X[order->row[k]];
            for (i = order->lower_at[k]; i < order->lower_at[k + 1]; ++i)
                X[order->lower[i]] -= S[(long)order->lower_entry[i] * EG_LANES] * x;
        }
        for (k = n - 1; k >= 0; --k) {
            double x = X[order->row[k]];
            for (j = order->upper_at[k]; j < order->upper_at[k + 1]; ++j)
                x -= S[(long)order->upper_entry[j] * EG_LANES] * room[order->upper[j]];
            room[order->column[k]] = x * S[(long)order->pivot[k] * EG_LANES];
        }
        memcpy(X, room, (size_t)n * sizeof *X);
        return;
    }
    for (k = 0; k < n; ++k)
        for (i = order->lower_at[k]; i < order->lower_at[k + 1]; ++i)
            eg_add_scaled(X + order->lower[i] * count, -S[(long)order->lower_entry[i] * EG_LANES],
                X + order->row[k] * count, count);
    for (k = n - 1; k >= 0; --k) {
        double *x = room + order->column[k] * count;
        memcpy(x, X + order->row[k] * count, (size_t)count * sizeof *x);
        for (j = order->upper_at[k]; j < order->upper_at[k + 1]; ++j)
            eg_add_scaled(x, -S[(long)order->upper_entry[j] * EG_LANES], room + order->upper[j] * count, count);
        eg_multiply(x, S[(long)order->pivot[k] * EG_LANES], count);
    }
    memcpy(X, room, (size_t)(n * count) * sizeof *X);
}

/* X := S^-T X. */
static void eg_solve_lane_transposed(const eg_order *order, const double *S, double *X, long count, double *room)
{
    const int n = order->n;
    int i, j, k;
    if (count == 1) {
        for (k = 0; k < n; ++k) {
            const double x = X[order->column[k]] * S[(long)order->pivot[k] * EG_LANES];
            room[order->row[k]] = x;
            for (j = order->upper_at[k]; j < order->upper_at[k + 1]; ++j)
                X[order->upper[j]] -= S[(long)order->upper_entry[j] * EG_LANES] * x;
        }
        for (k = n - 1; k >= 0; --k) {
            double x = room[order->row[k]];
            for (i = order->lower_at[k]; i < order->lower_at[k + 1]; ++i)
                x -= S[(long)order->lower_entry[i] * EG_LANES] * room[order->lower[i]];
            room[order->row[k]] = x;
        }
        memcpy(X, room, (size_t)n * sizeof *X);
        return;
    }
    for (k = 0; k < n; ++k) {
        double *x = room + order->row[k] * count;
        memcpy(x, X + order->column[k] * count, (size_t)count * sizeof *x);
        eg_multiply(x, S[(long)order->pivot[k] * EG_LANES], count);
        for (j = order->upper_at[k]; j < order->upper_at[k + 1]; ++j)
            eg_add_scaled(X + order->upper[j] * count, -S[(long)order->upper_entry[j] * EG_LANES], x, count);
    }
    for (k = n - 1; k >= 0; --k)
        for (i = order->lower_at[k]; i < order->lower_at[k + 1]; ++i)
            eg_add_scaled(room + order->row[k] * count, -S[(long)order->lower_entry[i] * EG_LANES],
                room + order->lower[i] * count, count);
    memcpy(X, room, (size_t)(n * count) * sizeof *X);
}
