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

/* A matrix of each step: element (i, j) of step k is x[k step + i row + j column]. */
typedef struct eg_block {
    const double *x;
    long step, row, column;
} eg_block;

/* Partials of e at the end of a step: rows R: residual, F: minus rates of internal states, H: holonomic constraints with
 * eta, Z: rates of constraints; columns q, v, z, and p: parameters. M: of the residual in vdot, L: in lam, transposed. G: B W at the
 * start of a step, N: partials of W B^T eta in q there, Np: in the first parameters, NW: in W, its diagonal, which is the
 * last nv parameters. T: of the rotating factors, one behind the other. Blocks up to G are in the matrix of a step. */
enum {
    EG_RQ, EG_FQ, EG_HQ, EG_ZQ, EG_RV, EG_FV, EG_ZV, EG_M, EG_RZ, EG_FZ, EG_L, EG_T, EG_G,
    EG_RP, EG_FP, EG_HP, EG_ZP, EG_N, EG_NP, EG_NW, EG_BLOCKS
};

/* Arguments of the caller; matrices of as many steps as there are, in their order. */
typedef struct eg_steps {
    long nv, nz, nl, nh; /* velocities, internal states, rows of constraints, holonomic ones with eta */
    long np, nown, nshared; /* parameters; columns of the partials of e, of Np: of the first parameters */
    long steps, directions;
    long turns;          /* rotating factors: first velocity component and size (3 or 6) of each */
    const long *turn;
    const double *coefficients; /* h, alpha_m, alpha_f, beta, gamma, and alpha_m and gamma of first order */
    eg_block block[20];         /* EG_BLOCKS */
    const double *A, *T;        /* Ad(exp(-h D)) and T of the rotating factors, one behind the other */
    int *plan;                  /* of the sums and the elimination, of so many integers, and (n) scales of rows */
    long capacity;
    double *scale;
    const long long *unseen;    /* places that the plan lacks */
    long first;                 /* step at which tangents begin */
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

static long eg_turning(const eg_steps *given)
{
    long f, turning = 0;
    for (f = 0; f < given->turns; ++f)
        turning += given->turn[2 * f + 1] * given->turn[2 * f + 1];
    return turning;
}

static long eg_equations(const eg_steps *given) { return given->nv + given->nz + given->nh + given->nl; }

/* Rows and columns of a block. */
static void eg_shape(const eg_steps *given, int block, long *rows, long *columns)
{
    const long nv = given->nv, nz = given->nz, nl = given->nl, nh = given->nh, own = given->nown;
    const long shapes[2 * EG_BLOCKS] = { nv, nv, nz, nv, nh, nv, nl, nv, nv, nv, nz, nv, nl, nv, nv, nv, nv, nz, nz, nz, nl,
        nv, 1, eg_turning(given), nh, nv, nv, own, nz, own, nh, own, nl, own, nh ? nv : 0, nv, nh ? nv : 0,
        given->nshared, nh ? nv : 0, 1 };
    *rows = shapes[2 * block];
    *columns = shapes[2 * block + 1];
}

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

/* Doubles for the values of a plan, and for its entries if all are filled. */
EG_SEEN long eomgen_plan_room(const eg_steps *given)
{
    return (eg_plan_of(given)->values + eg_equations(given) * eg_equations(given)) * EG_LANES;
}

/* Choose the order of pivots by steps from the first to the last. numbers: room as above, nonzero: (n, n), room: as above.
 * 0: done, -1: it needs more memory. */
EG_SEEN int eomgen_step_order(const eg_steps *given, int *numbers, char *nonzero, double *room)
{
    const long n = eg_equations(given);
    const eg_gains g = eg_gains_of(given->coefficients);
    eg_plan *plan = eg_plan_of(given);
    double *S = room + (long)plan->values * EG_LANES, c[EG_COEFFICIENTS];
    int *sum = given->plan + (plan->sum - given->plan), *entry = numbers, *place, e;
    long lanes[EG_LANES];
    eg_arena arena;
    arena.memory = given->plan;
    arena.used = plan->used;
    arena.capacity = given->capacity;
    arena.full = 0;
    for (e = 0; e < EG_LANES; ++e)
        lanes[e] = given->steps * (2 * e + 1) / (2 * EG_LANES);
    memset(nonzero, 0, (size_t)(n * n));
    for (e = 0; e < plan->sums; ++e)
        nonzero[sum[3 * e]] = 1;
    place = eg_take(&arena, n * n);
    if (arena.full)
        return -1;
    for (e = 0; e < n * n; ++e)
        place[e] = e;
    plan->place = place;
    eg_coefficients_of(&g, c);
    plan->entries = (int)(n * n);
    eg_gather(given, plan, lanes, room);
    eg_matrices(plan, c, room, S);
    plan->eliminated = eg_choose_order(&plan->order, &arena, nonzero, S, given->scale, entry, numbers + n * n, (int)n);
    if (arena.full)
        return -1;
    if (plan->eliminated) {
        for (e = 0; e < n * n; ++e)
            if (entry[e] >= 0)
                place[entry[e]] = e;
        for (e = 0; e < plan->sums; ++e)
            sum[3 * e] = entry[sum[3 * e]];
        plan->entries = plan->order.entries;
    }
    given->plan[0] = 1;
    return 0;
}

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

/* T and Ad(exp(-theta)) = 1 - ad(theta) T of rotating factors at theta, (nv) of each step. kind: 0: SO(3), 1: R^3 x SO(3),
 * 2: SE(3); turn as above. T and A: blocks of a step one behind the other. T of SO(3) is 1 - a X + b X^2, X the skew matrix
 * of the rotation; of SE(3), with Y that of the translation, its corner is the derivative of this along Y. */
EG_SEEN void eomgen_step_turning(long steps, long nv, long turns, const long *turn, const long *kind,
    const double *theta, double *A, double *T)
{
    long k, f, i, j, t;
    for (k = 0; k < steps; ++k, theta += nv)
        for (f = 0; f < turns; ++f) {
            const long size = turn[2 * f + 1];
            const double *w = theta + turn[2 * f], *u = w + 3, x = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
            const double X[9] = { 0.0, -w[2], w[1], w[2], 0.0, -w[0], -w[1], w[0], 0.0 };
            double a, b, da, db; /* da, db: derivatives by the angle over the angle */
            double Y[9] = { 0.0 };
            if (x < 0.25) { /* (1 - cos)/x, (angle - sin)/angle^3 and their derivatives as series */
                double term = 1.0;
                a = b = da = db = 0.0;
                for (i = 0; i < 9; ++i) {
                    const double n = 2.0 * (double)i, next = term * -x / ((n + 1.0) * (n + 2.0));
                    a += term / ((n + 1.0) * (n + 2.0));
                    b += term / ((n + 1.0) * (n + 2.0) * (n + 3.0));
                    da -= term * (n + 2.0) / ((n + 1.0) * (n + 2.0) * (n + 3.0) * (n + 4.0));
                    db -= term * (n + 2.0) / ((n + 1.0) * (n + 2.0) * (n + 3.0) * (n + 4.0) * (n + 5.0));
                    term = next;
                }
            } else {
                const double angle = sqrt(x), s = sin(angle), c = cos(angle);
                a = (1.0 - c) / x;
                b = (angle - s) / (x * angle);
                da = (s / angle - 2.0 * a) / x;
                db = (a - 3.0 * b) / x;
            }
            if (kind[f] == 2) {
                Y[1] = -u[2];
                Y[2] = u[1];
                Y[3] = u[2];
                Y[5] = -u[0];
                Y[6] = -u[1];
                Y[7] = u[0];
            }
            memset(T, 0, (size_t)(size * size) * sizeof *T);
            for (i = 0; i < 3; ++i)
                for (j = 0; j < 3; ++j) {
                    double square = 0.0, mixed = 0.0, along = 0.0;
                    for (t = 0; t < 3; ++t) {
                        square += X[3 * i + t] * X[3 * t + j];
                        mixed += X[3 * i + t] * Y[3 * t + j] + Y[3 * i + t] * X[3 * t + j];
                    }
                    T[i * size + j] = (double)(i == j) - a * X[3 * i + j] + b * square;
                    if (kind[f] == 2) {
                        along = w[0] * u[0] + w[1] * u[1] + w[2] * u[2];
                        T[(3 + i) * size + 3 + j] = T[i * size + j];
                        T[(3 + i) * size + j] = -a * Y[3 * i + j] + b * mixed + along * (db * square - da * X[3 * i + j]);
                    } else if (kind[f] == 1)
                        T[(3 + i) * size + 3 + j] = (double)(i == j);
                }
            for (i = 0; i < size; ++i)
                for (j = 0; j < size; ++j) {
                    double product = 0.0;
                    for (t = 0; t < 3; ++t)
                        if (i < 3)
                            product += X[3 * i + t] * T[t * size + j];
                        else if (kind[f] == 2)
                            product += Y[3 * (i - 3) + t] * T[t * size + j] + X[3 * (i - 3) + t] * T[(3 + t) * size + j];
                    A[i * size + j] = (double)(i == j) - product;
                }
            T += size * size;
            A += size * size;
        }
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

/* Doubles for a sweep. */
EG_SEEN long eomgen_step_room(const eg_steps *given)
{
    const long n = eg_equations(given), count = given->directions;
    const eg_plan *plan = eg_plan_of(given);
    return (long)(plan->values + plan->entries) * EG_LANES + n * n + 2 * n
        + (2 * n + 5 * given->nv + 3 * given->nz + 6) * count;
}

/* Factors of the matrices of EG_LANES steps; those that are not fine have factors of their own. */
typedef struct eg_factors {
    const eg_plan *plan;
    double *values, *S, *own, *row, *column;
    long *pivot;
    long long fine[EG_LANES];
    double c[EG_COEFFICIENTS];
} eg_factors;

/* Begin with a sweep; returns the room that is left. */
static double *eg_begin(const eg_steps *given, const eg_gains *g, double *room, long *pivot, eg_factors *f)
{
    const long n = eg_equations(given);
    f->plan = eg_plan_of(given);
    f->values = room;
    f->S = f->values + (long)f->plan->values * EG_LANES;
    f->own = f->S + (long)f->plan->entries * EG_LANES;
    f->row = f->own + n * n;
    f->column = f->row + n;
    f->pivot = pivot;
    eg_coefficients_of(g, f->c);
    return f->column + n;
}

/* Factor the matrices of the steps from first on, the last of them several times if there are fewer than lanes. 0: they
 * have other nonzeros than the plan. */
static int eg_factor_steps(const eg_steps *given, long first, eg_factors *f)
{
    long numbers[EG_LANES], w;
    if (eg_differs(given, first, first + EG_LANES < given->steps ? first + EG_LANES : given->steps))
        return 0;
    for (w = 0; w < EG_LANES; ++w)
        numbers[w] = first + w < given->steps ? first + w : given->steps - 1;
    eg_gather(given, f->plan, numbers, f->values);
    for (w = 0; w < EG_LANES; ++w)
        f->fine[w] = 0;
    if (f->plan->eliminated) {
        eg_matrices(f->plan, f->c, f->values, f->S);
        eg_factor_lanes(&f->plan->order, f->S, f->fine);
    }
    return 1;
}

/* X := S^-1 X, or S^-T X, of the step of a lane; room: as many numbers. 0: singular. */
static int eg_solve_step(const eg_factors *f, int lane, int transposed, long n, double *X, long count, double *room)
{
    if (!f->fine[lane]) {
        eg_dense_matrix(f->plan, f->c, f->values, lane, n, f->own);
        if (!eg_factor(f->own, f->row, f->column, f->pivot, n))
            return 0;
        if (transposed)
            eg_solve_transposed(f->own, f->row, f->column, f->pivot, n, X, count);
        else
            eg_solve(f->own, f->row, f->column, f->pivot, n, X, count);
    } else if (transposed)
        eg_solve_lane_transposed(&f->plan->order, f->S + lane, X, count, room);
    else
        eg_solve_lane(&f->plan->order, f->S + lane, X, count, room);
    return 1;
}

/* Tangents through the steps. state, in and out, (4 nv + 3 nz, directions): dq, dv, dvdot, da, dz, dzdot, dr. dp: (np,
 * directions). record, of each step, (3 nv + nz + nl, directions): dq, dv, dvdot, dz, dlam at its end; eta, of each step,
 * (nh, directions). Returns the number of the first step whose matrix is singular, else the number of steps; -1 - k: the
 * plan lacks nonzeros of step k, at which all is ready to go on. */
EG_SEEN long eomgen_step_tangents(const eg_steps *given, const double *dp, double *state, double *record, double *eta,
    double *room, long *pivot)
{
    const long nv = given->nv, nz = given->nz, nl = given->nl, nh = given->nh, np = given->np;
    const long n = nv + nz + nh + nl, count = given->directions, block = nv * count, small = nz * count;
    const long turning = eg_turning(given), shared = nh ? np - nv : 0;
    const eg_gains g = eg_gains_of(given->coefficients);
    eg_factors f;
    double *x = eg_begin(given, &g, room, pivot, &f), *D = x + n * count, *temporary = D + block,
        *solved = temporary + 6 * count;
    double *q = state, *v = q + block, *vdot = v + block, *a = vdot + block, *z = a + block, *zdot = z + small,
        *r = zdot + small;
    const long row_of[4] = { 0, nv, nv + nz, nv + nz + nh };
    const int in_q[4] = { EG_RQ, EG_FQ, EG_HQ, EG_ZQ }, in_v[4] = { EG_RV, EG_FV, -1, EG_ZV },
        in_p[4] = { EG_RP, EG_FP, EG_HP, EG_ZP };
    long k, group;
    record += given->first * (3 * nv + nz + nl) * count;
    for (k = given->first; k < given->steps; ++k) {
        const int lane = (int)(k % EG_LANES);
        const double *A = given->A + k * turning, *T = given->T + k * turning, *own = f.values + lane;
        if (!lane && !eg_factor_steps(given, k, &f))
            return -1 - k;
        /* the part that the unknowns do not change */
        memcpy(D, v, (size_t)block * sizeof *D);
        eg_add_scaled(D, g.h * (0.5 - g.beta), a, block);
        if (nh) {
            eg_add_block(f.plan, EG_N, own, -1.0, q, D, count);
            eg_add_block(f.plan, EG_NP, own, -1.0, dp, D, count);
            eg_add_diagonal(f.plan, own, -1.0, dp + shared * count, D, count);
        }
        eg_turn(given, A, 0, q, count, temporary);
        eg_turn(given, T, 0, D, count, temporary);
        eg_add_scaled(q, g.h, D, block);
        eg_add_scaled(v, g.h * (1.0 - g.gamma), a, block);
        eg_multiply(vdot, -g.af / (1.0 - g.af), block);
        eg_add_scaled(vdot, g.am / (1.0 - g.af), a, block);
        eg_add_scaled(z, g.h * (1.0 - g.zgamma), r, small);
        eg_multiply(zdot, -g.af / (1.0 - g.af), small);
        eg_add_scaled(zdot, g.zam / (1.0 - g.af), r, small);
        memset(x, 0, (size_t)(n * count) * sizeof *x);
        for (group = 0; group < 4; ++group) {
            double *rows = x + row_of[group] * count;
            eg_add_block(f.plan, in_q[group], own, -1.0, q, rows, count);
            if (in_v[group] >= 0)
                eg_add_block(f.plan, in_v[group], own, -1.0, v, rows, count);
            eg_add_block(f.plan, in_p[group], own, -1.0, dp, rows, count);
        }
        eg_add_block(f.plan, EG_M, own, -1.0, vdot, x, count);
        eg_add_block(f.plan, EG_RZ, own, -1.0, z, x, count);
        eg_add_block(f.plan, EG_FZ, own, -1.0, z, x + block, count);
        eg_add_scaled(x + block, -1.0, zdot, small);
        if (!eg_solve_step(&f, lane, 0, n, x, count, solved))
            return k;
        /* the end of the step */
        memcpy(a, x, (size_t)block * sizeof *a);
        eg_add_scaled(vdot, g.to_vdot, a, block);
        eg_add_scaled(v, g.h * g.gamma, a, block);
        memset(D, 0, (size_t)block * sizeof *D);
        eg_add_scaled(D, g.h * g.beta, a, block);
        if (nh) {
            eg_add_block_transposed(f.plan, EG_G, own, -1.0, x + (nv + nl) * count, D, count);
            memcpy(eta + k * nh * count, x + (nv + nl) * count, (size_t)(nh * count) * sizeof *eta);
        }
        eg_turn(given, T, 0, D, count, temporary);
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
 * h D and in eta, if these are differentiated once more. Returns as tangents do. */
EG_SEEN long eomgen_step_adjoints(const eg_steps *given, const double *direct, const double *sources, double *state,
    double *gradient, double *multipliers, double *ends, double *room, long *pivot)
{
    const long nv = given->nv, nz = given->nz, nl = given->nl, nh = given->nh, np = given->np;
    const long n = nv + nz + nh + nl, count = given->directions, block = nv * count, small = nz * count;
    const long turning = eg_turning(given), shared = nh ? np - nv : 0;
    const eg_gains g = eg_gains_of(given->coefficients);
    eg_factors f;
    double *D = eg_begin(given, &g, room, pivot, &f), *temporary = D + block, *solved = temporary + 6 * count;
    double *q = state, *v = q + block, *vdot = v + block, *a = vdot + block, *z = a + block, *zdot = z + small,
        *r = zdot + small;
    const long row_of[4] = { 0, nv, nv + nz, nv + nz + nh };
    const int in_q[4] = { EG_RQ, EG_FQ, EG_HQ, EG_ZQ }, in_v[4] = { EG_RV, EG_FV, -1, EG_ZV },
        in_p[4] = { EG_RP, EG_FP, EG_HP, EG_ZP };
    long k, group;
    for (k = given->steps - 1; k >= 0; --k) {
        const int lane = (int)(k % EG_LANES);
        const double *A = given->A + k * turning, *T = given->T + k * turning, *values = f.values + lane;
        const double *own = direct + k * (3 * nv + nz + nl) * count;
        const double *source = sources ? sources + k * (2 * nv + nh) * count : sources;
        double *x = multipliers + k * n * count;
        long i;
        if ((lane == EG_LANES - 1 || k == given->steps - 1) && !eg_factor_steps(given, k - lane, &f))
            return -1 - k;
        eg_add_scaled(q, 1.0, own, 3 * block);
        eg_add_scaled(z, 1.0, own + 3 * block, small);
        /* of the unknowns */
        memcpy(D, q, (size_t)block * sizeof *D);
        eg_turn(given, T, 1, D, count, temporary);
        if (source)
            eg_add_scaled(D, 1.0, source + block, block);
        memset(x, 0, (size_t)(n * count) * sizeof *x);
        for (i = 0; i < block; ++i)
            x[i] = a[i] + g.h * g.gamma * v[i] + g.to_vdot * vdot[i] + g.h * g.h * g.beta * D[i];
        memcpy(x + block, own + 3 * block + small, (size_t)(nl * count) * sizeof *x);
        if (nh)
            eg_add_block(f.plan, EG_G, values, -g.h, D, x + (nv + nl) * count, count);
        if (nh && source)
            eg_add_scaled(x + (nv + nl) * count, 1.0, source + 2 * block, nh * count);
        for (i = 0; i < small; ++i)
            x[(nv + nl + nh) * count + i] = r[i] + g.h * g.zgamma * z[i] + g.to_zdot * zdot[i];
        if (!eg_solve_step(&f, lane, 1, n, x, count, solved))
            return k;
        /* of the part that the unknowns do not change */
        for (group = 0; group < 4; ++group) {
            const double *rows = x + row_of[group] * count;
            eg_add_block_transposed(f.plan, in_q[group], values, -1.0, rows, q, count);
            if (in_v[group] >= 0)
                eg_add_block_transposed(f.plan, in_v[group], values, -1.0, rows, v, count);
            eg_add_block_transposed(f.plan, in_p[group], values, -1.0, rows, gradient, count);
        }
        eg_add_block_transposed(f.plan, EG_M, values, -1.0, x, vdot, count);
        eg_add_block_transposed(f.plan, EG_RZ, values, -1.0, x, z, count);
        eg_add_block_transposed(f.plan, EG_FZ, values, -1.0, x + block, z, count);
        eg_add_scaled(zdot, -1.0, x + block, small);
        /* of the start of the step */
        memcpy(D, q, (size_t)block * sizeof *D);
        memcpy(ends + 2 * k * block, q, (size_t)block * sizeof *ends);
        eg_turn(given, T, 1, D, count, temporary);
        if (source)
            eg_add_scaled(D, 1.0, source + block, block);
        for (i = 0; i < block; ++i)
            D[i] *= g.h;
        memcpy(ends + (2 * k + 1) * block, D, (size_t)block * sizeof *ends);
        eg_turn(given, A, 1, q, count, temporary);
        if (source)
            eg_add_scaled(q, 1.0, source, block);
        if (nh) {
            eg_add_block_transposed(f.plan, EG_N, values, -1.0, D, q, count);
            eg_add_block_transposed(f.plan, EG_NP, values, -1.0, D, gradient, count);
            eg_add_diagonal(f.plan, values, -1.0, D, gradient + shared * count, count);
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
