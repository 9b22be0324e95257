/* The plan of a step: sums over the nonzeros of its blocks, by which its matrix is made.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models.
 */

/* Coefficients of the sums of a step's matrix. */
enum { EG_ONE, EG_OF_VDOT, EG_OF_V, EG_OF_Q, EG_OF_ETA, EG_OF_Z, EG_OF_ZDOT, EG_COEFFICIENTS };

/* Sums and the elimination of a step's matrix over the nonzeros of its blocks. Values: 1, nonzeros of the blocks, and
 * products; S: entries of the matrix, with unknowns da', dlam', deta, dr'. */
typedef struct eg_plan {
    int values, entries;
    long used;                                /* integers of the memory, without the order of pivots */
    int first[EG_BLOCKS], count[EG_BLOCKS];   /* values of the nonzeros of a block */
    const int *at[EG_BLOCKS];                 /* row and column of each */
    int products, sums, eliminated;           /* eliminated: whether there is an order of pivots */
    const int *product;                       /* value, and the two values whose product is added to it */
    const int *sum;                           /* entry, value, coefficient */
    const int *place;                         /* (entries): places in the dense matrix */
    eg_order order;
} eg_plan;

/* Integers in front of a plan, of which the first says whether the plan is made. */
#define EG_HEAD 16

static eg_plan *eg_plan_of(const eg_steps *given) { return (eg_plan *)(void *)(given->plan + EG_HEAD); }

/* Note which numbers are not 0. */
static void eg_join(long long *bits, const double *x, long count)
{
    long j = 0;
#if defined(EG_VECTORS)
    for (; j + EG_LANES <= count; j += EG_LANES)
        *(eg_bits *)(bits + j) |= *(const eg_lanes *)(x + j) != 0.0;
#endif
    for (; j < count; ++j)
        bits[j] |= x[j] != 0.0;
}

/* Note the nonzeros of the blocks of all steps in seen, block by block; whether there are new ones. */
static int eg_see(const eg_steps *given, unsigned char *seen, long long *bits)
{
    int b, anew = 0;
    for (b = 0; b < EG_BLOCKS; ++b) {
        const eg_block x = given->block[b];
        const long steps = x.step ? given->steps : 1;
        long rows, columns, i, j, k;
        eg_shape(given, b, &rows, &columns);
        memset(bits, 0, (size_t)(rows * columns) * sizeof *bits);
        for (k = 0; k < steps; ++k) {
            const double *from = x.x + k * x.step;
            if (x.column == 1 && x.row == columns)
                eg_join(bits, from, rows * columns);
            else if (x.column == 1)
                for (i = 0; i < rows; ++i)
                    eg_join(bits + i * columns, from + i * x.row, columns);
            else
                for (j = 0; j < columns; ++j)
                    for (i = 0; i < rows; ++i)
                        bits[i * columns + j] |= from[i * x.row + j * x.column] != 0.0;
        }
        for (i = 0; i < rows * columns; ++i)
            if (bits[i] && !seen[i])
                anew = seen[i] = 1;
        seen += rows * columns;
    }
    return anew;
}

/* Whether steps have nonzeros at other places than the plan: unseen, all bits set, are places that it lacks. */
static int eg_differs(const eg_steps *given, long first, long last)
{
    const long long *unseen = given->unseen;
    long long any = 0;
    int b;
    for (b = 0; b < EG_BLOCKS; ++b) {
        const eg_block x = given->block[b], *rates = given->block + EG_ZV;
        const int again = (b == EG_L || b == EG_HQ) && x.x == rates->x && x.row == rates->row && x.step == rates->step;
        long rows, columns, i, j, k;
        eg_shape(given, b, &rows, &columns);
        for (k = first; k < last && b != EG_T && !again && (x.step || k == first); ++k) {
            const int whole = x.column == 1 && x.row == columns;
            const long lines = whole ? 1 : rows, length = whole ? rows * columns : columns;
            for (i = 0; i < lines; ++i) {
                const double *from = x.x + k * x.step + i * x.row;
                const long long *mask = unseen + i * columns;
                j = 0;
#if defined(EG_VECTORS)
                if (x.column == 1) {
                    eg_bits bits = { 0 };
                    for (; j + EG_LANES <= length; j += EG_LANES)
                        bits |= (*(const eg_lanes *)(from + j) != 0.0) & *(const eg_bits *)(mask + j);
                    any |= (bits[0] | bits[1] | bits[2] | bits[3]) | (bits[4] | bits[5] | bits[6] | bits[7]);
                }
#endif
                for (; j < length; ++j)
                    any |= from[j * x.column] != 0.0 ? mask[j] : 0;
            }
        }
        unseen += rows * columns;
    }
    return any != 0;
}

static void eg_append(eg_arena *arena, int *count, int a, int b, int c)
{
    int *to = eg_take(arena, 3);
    if (to) {
        to[0] = a;
        to[1] = b;
        to[2] = c;
        ++*count;
    }
}

/* Integers that planning needs besides the plan. */
EG_SEEN long eomgen_plan_numbers(const eg_steps *given)
{
    const long n = eg_equations(given);
    return n * n + n * given->nv + given->nh * given->nv + n * given->nh + eg_turning(given) + 3 * n;
}

/* Places of all blocks. */
EG_SEEN long eomgen_plan_places(const eg_steps *given)
{
    long total = 0, rows, columns;
    int b;
    for (b = 0; b < EG_BLOCKS; ++b) {
        eg_shape(given, b, &rows, &columns);
        total += rows * columns;
    }
    return total;
}

/* Plan sums over the nonzeros of all steps, if there is no plan or there are new ones. seen: places of nonzeros so far,
 * bits: room for as many; numbers: room as above. Returns 0: there was a plan, 1: it is made but for the order of pivots,
 * -1: it needs more memory. */
EG_SEEN int eomgen_step_plan(const eg_steps *given, unsigned char *seen, long long *bits, int *numbers)
{
    const long nv = given->nv, nz = given->nz, nl = given->nl, nh = given->nh, n = eg_equations(given);
    const long row_of[4] = { 0, nv, nv + nz, nv + nz + nh };
    const int in_q[4] = { EG_RQ, EG_FQ, EG_HQ, EG_ZQ }, in_v[4] = { EG_RV, EG_FV, -1, EG_ZV };
    eg_arena arena;
    eg_plan *plan = eg_plan_of(given);
    int *turned = numbers + n * n, *of_G = turned + n * nv, *of_eta = of_G + nh * nv, *of_T = of_eta + n * nh;
    long i, j, k, f, group;
    int b, e, values = 1;
    const int anew = eg_see(given, seen, bits);
    if (given->plan[0] && !anew)
        return 0;
    given->plan[0] = 0;
    arena.memory = given->plan;
    arena.used = EG_HEAD + (long)((sizeof *plan + sizeof(int) - 1) / sizeof(int));
    arena.capacity = given->capacity;
    arena.full = arena.used > arena.capacity;
    if (arena.full)
        return -1;
    memset(plan, 0, sizeof *plan);
    for (b = 0; b < EG_BLOCKS; ++b) {
        long rows, columns;
        int *at = 0;
        eg_shape(given, b, &rows, &columns);
        plan->first[b] = values;
        plan->at[b] = arena.memory + arena.used;
        for (i = 0; i < rows; ++i)
            for (j = 0; j < columns; ++j)
                if (seen[i * columns + j] && (at = eg_take(&arena, 2)) != 0) {
                    at[0] = (int)i;
                    at[1] = (int)j;
                    ++plan->count[b];
                }
        values += plan->count[b];
        seen += rows * columns;
    }
    /* products: partials in q times T, and these times G^T */
    plan->product = arena.memory + arena.used;
    memset(numbers, 0, (size_t)eomgen_plan_numbers(given) * sizeof *numbers);
    for (group = 0; group < 4; ++group) {
        b = in_q[group];
        for (e = 0; e < plan->count[b]; ++e)
            turned[(row_of[group] + plan->at[b][2 * e]) * nv + plan->at[b][2 * e + 1]] = plan->first[b] + e;
    }
    for (e = 0; e < plan->count[EG_T]; ++e)
        of_T[plan->at[EG_T][2 * e + 1]] = plan->first[EG_T] + e;
    for (e = 0; e < plan->count[EG_G]; ++e)
        of_G[plan->at[EG_G][2 * e] * nv + plan->at[EG_G][2 * e + 1]] = plan->first[EG_G] + e;
    for (i = 0; i < n; ++i) {
        int place = 0, own[6], into[6];
        for (f = 0; f < given->turns; ++f) {
            const long first = given->turn[2 * f], size = given->turn[2 * f + 1];
            for (j = 0; j < size; ++j) {
                own[j] = turned[i * nv + first + j];
                into[j] = 0;
            }
            for (j = 0; j < size; ++j)
                for (k = 0; k < size; ++k)
                    if (own[k] && of_T[place + k * size + j]) {
                        if (!into[j])
                            into[j] = values++;
                        eg_append(&arena, &plan->products, into[j], own[k], of_T[place + k * size + j]);
                    }
            for (j = 0; j < size; ++j)
                turned[i * nv + first + j] = into[j];
            place += (int)(size * size);
        }
    }
    for (i = 0; i < n; ++i)
        for (j = 0; j < nh; ++j) {
            int into = 0;
            for (k = 0; k < nv; ++k)
                if (turned[i * nv + k] && of_G[j * nv + k]) {
                    if (!into)
                        into = values++;
                    eg_append(&arena, &plan->products, into, turned[i * nv + k], of_G[j * nv + k]);
                }
            of_eta[i * nh + j] = into;
        }
    plan->values = values;
    /* sums, whose entries are places in the dense matrix first */
    plan->sum = arena.memory + arena.used;
    for (group = 0; group < 4; ++group) {
        b = in_v[group];
        for (e = 0; b >= 0 && e < plan->count[b]; ++e)
            eg_append(&arena, &plan->sums, (int)((row_of[group] + plan->at[b][2 * e]) * n + plan->at[b][2 * e + 1]),
                plan->first[b] + e, EG_OF_V);
    }
    for (e = 0; e < plan->count[EG_M]; ++e)
        eg_append(&arena, &plan->sums, (int)(plan->at[EG_M][2 * e] * n + plan->at[EG_M][2 * e + 1]),
            plan->first[EG_M] + e, EG_OF_VDOT);
    for (e = 0; e < plan->count[EG_L]; ++e)
        eg_append(&arena, &plan->sums, (int)(plan->at[EG_L][2 * e + 1] * n + nv + plan->at[EG_L][2 * e]),
            plan->first[EG_L] + e, EG_ONE);
    for (group = 0; group < 2; ++group) {
        b = group ? EG_FZ : EG_RZ;
        for (e = 0; e < plan->count[b]; ++e)
            eg_append(&arena, &plan->sums,
                (int)((row_of[group] + plan->at[b][2 * e]) * n + nv + nl + nh + plan->at[b][2 * e + 1]),
                plan->first[b] + e, EG_OF_Z);
    }
    for (j = 0; j < nz; ++j)
        eg_append(&arena, &plan->sums, (int)((nv + j) * n + nv + nl + nh + j), 0, EG_OF_ZDOT);
    for (i = 0; i < n; ++i) {
        for (j = 0; j < nv; ++j)
            if (turned[i * nv + j])
                eg_append(&arena, &plan->sums, (int)(i * n + j), turned[i * nv + j], EG_OF_Q);
        for (j = 0; j < nh; ++j)
            if (of_eta[i * nh + j])
                eg_append(&arena, &plan->sums, (int)(i * n + nv + nl + j), of_eta[i * nh + j], EG_OF_ETA);
    }
    if (arena.full)
        return -1;
    plan->used = arena.used;
    return 1;
}
