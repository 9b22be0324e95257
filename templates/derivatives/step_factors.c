/* Elimination of the matrices of steps: the order of pivots, factors, solutions.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models.
 */

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
