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
 *
 * This file has the blocks of a step and its coefficients, steps.h what callers give; the plan, matrices, factors, reactions, rotations, tangents
 * and adjoints of steps follow, a file step_*.c each.
 */

/* Partials of e at the end of a step: rows R: residual, F: minus rates of internal states, H: holonomic constraints with
 * eta, Z: rates of constraints; columns q, v, z, and p: parameters. M: of the residual in vdot, L: in lam, transposed. G: B W at the
 * start of a step, N: partials of W B^T eta in q there, Np: in the first parameters, NW: in W, its diagonal, which is the
 * last nv parameters. T: of the rotating factors, one behind the other. Blocks up to G are in the matrix of a step. */
enum {
    EG_RQ, EG_FQ, EG_HQ, EG_ZQ, EG_RV, EG_FV, EG_ZV, EG_M, EG_RZ, EG_FZ, EG_L, EG_T, EG_G,
    EG_RP, EG_FP, EG_HP, EG_ZP, EG_N, EG_NP, EG_NW, EG_BLOCKS
};

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
