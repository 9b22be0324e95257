/* Linearised steps of generalized-alpha: arguments and functions, also the declarations that Python reads.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models.
 */

/* A matrix of each step: element (i, j) of step k is x[k step + i row + j column]. */
typedef struct eg_block {
    const double *x;
    long step, row, column;
} eg_block;

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

long eomgen_step_reactions(long steps, long nv, long nh, const double *B, long stride, const double *W, long w_stride,
    const double *moved, double *G, double *eta, double *reaction, double *room);
void eomgen_step_turning(long steps, long nv, long turns, const long *turn, const long *kind, const double *theta,
    double *A, double *T);
long eomgen_plan_places(const eg_steps *given);
long eomgen_plan_numbers(const eg_steps *given);
int eomgen_step_plan(const eg_steps *given, unsigned char *seen, long long *bits, int *numbers);
long eomgen_plan_room(const eg_steps *given);
int eomgen_step_order(const eg_steps *given, int *numbers, char *nonzero, double *room);
long eomgen_step_room(const eg_steps *given);
long eomgen_step_tangents(const eg_steps *given, const double *dp, double *state, double *record, double *eta,
    double *room, long *pivot);
long eomgen_step_adjoints(const eg_steps *given, const double *direct, const double *sources, double *state,
    double *gradient, double *multipliers, double *ends, double *room, long *pivot);
