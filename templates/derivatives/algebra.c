/* Linear algebra of steps made linear: blocks of directions, factors of a step's matrix.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models, in front of the sweeps of each family. Golub and Van Loan, Matrix
 * Computations (2013), chapter 3. Matrices are row-major, blocks of directions (size, directions).
 */
#include <math.h>
#include <string.h>

#if defined(__GNUC__)
#define EG_SEEN __attribute__((visibility("default")))
#else
#define EG_SEEN
#endif

#if defined(__GNUC__)
#define EG_VECTORS
#if defined(__AVX512F__)
#define EG_WIDE 8
#else
#define EG_WIDE 4
#endif
/* Neighbouring directions side by side. */
typedef double eg_vector __attribute__((vector_size(8 * EG_WIDE), aligned(8), may_alias));
#endif

/* Y (directions) += s times the sum of X[t step] D[t] (directions) over so many terms. Sums of four vectors stay in
 * registers; coefficients that are 0 by the structure of the equations are passed over. */
static void eg_accumulate(double *restrict Y, double s, const double *restrict X, long step, long terms,
    const double *restrict D, long count)
{
    long k = 0, t;
#if defined(EG_VECTORS)
    for (; k + 4 * EG_WIDE <= count; k += 4 * EG_WIDE) {
        eg_vector a = { 0.0 }, b = { 0.0 }, c = { 0.0 }, d = { 0.0 }, *to = (eg_vector *)(Y + k);
        for (t = 0; t < terms; ++t) {
            const double x = X[t * step];
            const eg_vector *from = (const eg_vector *)(D + t * count + k);
            if (x == 0.0)
                continue;
            a += x * from[0];
            b += x * from[1];
            c += x * from[2];
            d += x * from[3];
        }
        to[0] += s * a;
        to[1] += s * b;
        to[2] += s * c;
        to[3] += s * d;
    }
    for (; k + 2 * EG_WIDE <= count; k += 2 * EG_WIDE) {
        eg_vector a = { 0.0 }, b = { 0.0 }, *to = (eg_vector *)(Y + k);
        for (t = 0; t < terms; ++t) {
            const double x = X[t * step];
            const eg_vector *from = (const eg_vector *)(D + t * count + k);
            if (x == 0.0)
                continue;
            a += x * from[0];
            b += x * from[1];
        }
        to[0] += s * a;
        to[1] += s * b;
    }
    for (; k + EG_WIDE <= count; k += EG_WIDE) {
        eg_vector a = { 0.0 };
        for (t = 0; t < terms; ++t)
            if (X[t * step] != 0.0)
                a += X[t * step] * *(const eg_vector *)(D + t * count + k);
        *(eg_vector *)(Y + k) += s * a;
    }
#endif
    for (; k < count; ++k) {
        double total = 0.0;
        for (t = 0; t < terms; ++t)
            total += X[t * step] * D[t * count + k];
        Y[k] += s * total;
    }
}

/* Y += s X (rows, columns) D, D and Y of `count` directions. */
static void eg_add(double *restrict Y, double s, const double *restrict X, long rows, long columns,
    const double *restrict D, long count)
{
    long i;
    for (i = 0; i < rows; ++i)
        eg_accumulate(Y + i * count, s, X + i * columns, 1, columns, D, count);
}

/* Y += s X^T D. */
static void eg_add_transposed(double *restrict Y, double s, const double *restrict X, long rows, long columns,
    const double *restrict D, long count)
{
    long i, j;
    if (count == 1) {
        for (i = 0; i < rows; ++i) {
            const double x = s * D[i];
            for (j = 0; j < columns; ++j)
                Y[j] += X[i * columns + j] * x;
        }
        return;
    }
    for (j = 0; j < columns; ++j)
        eg_accumulate(Y + j * count, s, X + j, columns, rows, D, count);
}

/* Y += s D. */
static void eg_add_scaled(double *restrict Y, double s, const double *restrict D, long size)
{
    long i = 0;
#if defined(EG_VECTORS)
    for (; i + EG_WIDE <= size; i += EG_WIDE)
        *(eg_vector *)(Y + i) += s * *(const eg_vector *)(D + i);
#endif
    for (; i < size; ++i)
        Y[i] += s * D[i];
}

/* X *= s. */
static void eg_multiply(double *X, double s, long count)
{
    long k = 0;
#if defined(EG_VECTORS)
    for (; k + EG_WIDE <= count; k += EG_WIDE)
        *(eg_vector *)(X + k) *= s;
#endif
    for (; k < count; ++k)
        X[k] *= s;
}

/* 1 over the largest of so many numbers; 0 if all are 0, or one is no finite number. */
static double eg_inverse_of_largest(const double *x, long step, long count)
{
    double largest = 0.0;
    long i;
    for (i = 0; i < count; ++i) {
        const double size = fabs(x[i * step]);
        if (!(size <= largest))
            largest = size;
    }
    return largest > 0.0 && largest - largest == 0.0 ? 1.0 / largest : 0.0;
}

#define EG_PANEL 4

/* Y (size) -= sum of X[t] D[t] over so many terms, at most EG_PANEL; rows of D are `step` apart. */
static void eg_add_panel(double *restrict Y, const double *restrict X, long terms, const double *restrict D,
    long step, long size)
{
    long i = 0, t;
    int any = 0;
    for (t = 0; t < terms; ++t)
        any = any || X[t] != 0.0;
    if (!any)
        return;
    if (terms == EG_PANEL) {
        const double a = X[0], b = X[1], c = X[2], d = X[3];
#if defined(EG_VECTORS)
        for (; i + EG_WIDE <= size; i += EG_WIDE) {
            eg_vector *to = (eg_vector *)(Y + i);
            *to -= (a * *(const eg_vector *)(D + i) + b * *(const eg_vector *)(D + step + i))
                + (c * *(const eg_vector *)(D + 2 * step + i) + d * *(const eg_vector *)(D + 3 * step + i));
        }
#endif
        for (; i < size; ++i)
            Y[i] -= (a * D[i] + b * D[step + i]) + (c * D[2 * step + i] + d * D[3 * step + i]);
        return;
    }
    for (t = 0; t < terms; ++t)
        eg_add_scaled(Y, -X[t], D + t * step, size);
}

/* Factor the columns k to end of the rows from k on, with partial pivoting of whole rows; 0: singular. */
static int eg_factor_panel(double *S, long *pivot, long k, long end, long n)
{
    long i, j;
    for (; k < end; ++k) {
        double inverse;
        long best = k;
        for (i = k + 1; i < n; ++i)
            if (fabs(S[i * n + k]) > fabs(S[best * n + k]))
                best = i;
        pivot[k] = best;
        if (!(fabs(S[best * n + k]) > 0.0))
            return 0;
        if (best != k)
            for (j = 0; j < n; ++j) {
                const double swap = S[k * n + j];
                S[k * n + j] = S[best * n + j];
                S[best * n + j] = swap;
            }
        inverse = 1.0 / S[k * n + k];
        for (i = k + 1; i < n; ++i) {
            const double factor = S[i * n + k] * inverse;
            S[i * n + k] = factor;
            for (j = k + 1; j < end && factor != 0.0; ++j)
                S[i * n + j] -= factor * S[k * n + j];
        }
    }
    return 1;
}

/* LU with partial pivoting of a matrix whose rows and columns are scaled by their largest entries; 0: singular. */
static int eg_factor(double *S, double *row, double *column, long *pivot, long n)
{
    long i, j, k;
    for (i = 0; i < n; ++i) {
        row[i] = eg_inverse_of_largest(S + i * n, 1, n);
        if (row[i] == 0.0)
            return 0;
        eg_multiply(S + i * n, row[i], n);
    }
    for (j = 0; j < n; ++j) {
        column[j] = eg_inverse_of_largest(S + j, n, n);
        if (column[j] == 0.0)
            return 0;
    }
    for (i = 0; i < n; ++i)
        for (j = 0; j < n; ++j)
            S[i * n + j] *= column[j];
    for (k = 0; k < n; k += EG_PANEL) {
        const long end = k + EG_PANEL < n ? k + EG_PANEL : n;
        if (!eg_factor_panel(S, pivot, k, end, n))
            return 0;
        for (i = k + 1; i < end; ++i) /* the rows of the panel, behind the panel */
            for (j = k; j < i; ++j)
                eg_add_scaled(S + i * n + end, -S[i * n + j], S + j * n + end, n - end);
        for (i = end; i < n; ++i)
            eg_add_panel(S + i * n + end, S + i * n + k, end - k, S + k * n + end, n, n - end);
    }
    return 1;
}

static void eg_swap(double *X, long i, long j, long count)
{
    long k;
    if (i != j)
        for (k = 0; k < count; ++k) {
            const double swap = X[i * count + k];
            X[i * count + k] = X[j * count + k];
            X[j * count + k] = swap;
        }
}

static void eg_scale(double *X, const double *by, long n, long count)
{
    long i;
    for (i = 0; i < n; ++i)
        eg_multiply(X + i * count, by[i], count);
}

/* X := S^-1 X. */
static void eg_solve(const double *S, const double *row, const double *column, const long *pivot, long n,
    double *X, long count)
{
    long i;
    eg_scale(X, row, n, count);
    for (i = 0; i < n; ++i)
        eg_swap(X, i, pivot[i], count);
    for (i = 1; i < n; ++i)
        eg_accumulate(X + i * count, -1.0, S + i * n, 1, i, X, count);
    for (i = n - 1; i >= 0; --i) {
        eg_accumulate(X + i * count, -1.0, S + i * n + i + 1, 1, n - 1 - i, X + (i + 1) * count, count);
        eg_multiply(X + i * count, 1.0 / S[i * n + i], count);
    }
    eg_scale(X, column, n, count);
}

/* X := S^-T X. */
static void eg_solve_transposed(const double *S, const double *row, const double *column, const long *pivot,
    long n, double *X, long count)
{
    long i;
    eg_scale(X, column, n, count);
    for (i = 0; i < n; ++i) {
        eg_accumulate(X + i * count, -1.0, S + i, n, i, X, count);
        eg_multiply(X + i * count, 1.0 / S[i * n + i], count);
    }
    for (i = n - 2; i >= 0; --i)
        eg_accumulate(X + i * count, -1.0, S + (i + 1) * n + i, n, n - 1 - i, X + (i + 1) * count, count);
    for (i = n - 1; i >= 0; --i)
        eg_swap(X, i, pivot[i], count);
    eg_scale(X, row, n, count);
}
