/* The shear frame as y' = f(t, y), y = (q, v), with its exact Jacobian, from eomgen's generated functions; and CVODE of
 * SUNDIALS 7 on both, without Python between. Prototypes are declared here, since wheels bring libraries without headers
 * (double, int32 as index, no MPI). */
#include <stdlib.h>

#include "shear_frame.h"

enum { N = SHEAR_FRAME_NV };

/* dy = f(t, y). */
void frame_rates(double t, const double *y, double *dy)
{
    shear_frame_base_state base;
    shear_frame_base(t, &base);
    for (int i = 0; i < N; i++) {
        dy[i] = y[N + i];
    }
    shear_frame_forward_dynamics(y, y + N, &base, dy + N);
}

/* J = df/dy in columns: below the unit matrix, -M^-1 K and -M^-1 C at the accelerations of the motion; M = L D L^T. */
void frame_jacobian(double t, const double *y, double *J)
{
    shear_frame_base_state base;
    double a[N], K[N * N], C[N * N], M[N * N];
    shear_frame_base(t, &base);
    shear_frame_forward_dynamics(y, y + N, &base, a);
    shear_frame_partials(y, y + N, a, &base, K, C, M);
    for (int j = 0; j < N; j++) {
        for (int i = j + 1; i < N; i++) {
            double ratio = M[i * N + j] / M[j * N + j];
            if (ratio != 0.0) {
                for (int k = j; k < N; k++) {
                    M[i * N + k] -= ratio * M[j * N + k];
                }
            }
            M[i * N + j] = ratio;
        }
    }
    for (int column = 0; column < 2 * N; column++) {
        const double *right = column < N ? K + column : C + column - N;
        double *upper = J + 2 * N * column, *lower = upper + N;
        for (int i = 0; i < N; i++) {
            upper[i] = column == N + i ? 1.0 : 0.0;
            lower[i] = -right[i * N];
            for (int k = 0; k < i; k++) {
                lower[i] -= M[i * N + k] * lower[k];
            }
        }
        for (int i = N - 1; i >= 0; i--) {
            for (int k = i + 1; k < N; k++) {
                lower[i] -= M[i * N + k] * lower[k];
            }
            lower[i] /= M[i * N + i];
        }
    }
}

#ifdef WITH_CVODE

typedef struct vector_of_sundials *Vector;
typedef struct matrix_of_sundials *Matrix;
typedef struct solver_of_sundials *Solver;
typedef struct context_of_sundials *Context;
typedef int (*Rates)(double, Vector, Vector, void *);
typedef int (*Jacobian)(double, Vector, Vector, Matrix, void *, Vector, Vector, Vector);

int SUNContext_Create(int communicator, Context *context);
int SUNContext_ClearErrHandlers(Context context);
Vector N_VNew_Serial(int length, Context context);
double *N_VGetArrayPointer(Vector vector);
Matrix SUNDenseMatrix(int rows, int columns, Context context);
double *SUNDenseMatrix_Data(Matrix matrix);
Solver SUNLinSol_Dense(Vector vector, Matrix matrix, Context context);
void *CVodeCreate(int method, Context context);
int CVodeInit(void *memory, Rates rates, double t, Vector y);
int CVodeReInit(void *memory, double t, Vector y);
int CVodeSVtolerances(void *memory, double relative, Vector absolute);
int CVodeSetMaxOrd(void *memory, int order);
int CVodeSetMaxNumSteps(void *memory, long steps);
int CVodeSetStabLimDet(void *memory, int detect);
int CVodeSetStopTime(void *memory, double t);
int CVodeSetLinearSolver(void *memory, Solver solver, Matrix matrix);
int CVodeSetJacFn(void *memory, Jacobian jacobian);
int CVode(void *memory, double end, Vector y, double *t, int task);
int CVodeGetNumSteps(void *memory, long *steps);

typedef struct {
    void *memory;
    Vector y, absolute;
} Integrator;

static int rates(double t, Vector y, Vector dy, void *unused)
{
    (void)unused;
    frame_rates(t, N_VGetArrayPointer(y), N_VGetArrayPointer(dy));
    return 0;
}

static int jacobian(double t, Vector y, Vector dy, Matrix J, void *unused, Vector r, Vector s, Vector w)
{
    (void)dy, (void)unused, (void)r, (void)s, (void)w;
    frame_jacobian(t, N_VGetArrayPointer(y), SUNDenseMatrix_Data(J));
    return 0;
}

static void start(Integrator *one)
{
    double *y = N_VGetArrayPointer(one->y);
    shear_frame_initial_state(y, y + N, NULL);
}

/* Return BDF of orders up to the given one, or a null pointer; absolute tolerances are `relative` times `scale`. */
Integrator *frame_cvode(double relative, const double *scale, int order, int detect_stability_limit)
{
    Context context = NULL;
    Integrator *one = malloc(sizeof *one);
    if (one == NULL || SUNContext_Create(0, &context)) {
        return NULL;
    }
    SUNContext_ClearErrHandlers(context);
    one->y = N_VNew_Serial(2 * N, context);
    one->absolute = N_VNew_Serial(2 * N, context);
    for (int i = 0; i < 2 * N; i++) {
        N_VGetArrayPointer(one->absolute)[i] = relative * scale[i];
    }
    start(one);
    one->memory = CVodeCreate(2, context);
    Matrix matrix = SUNDenseMatrix(2 * N, 2 * N, context);
    Solver solver = SUNLinSol_Dense(one->y, matrix, context);
    int failed = CVodeInit(one->memory, rates, 0.0, one->y);
    failed |= CVodeSVtolerances(one->memory, relative, one->absolute);
    failed |= CVodeSetLinearSolver(one->memory, solver, matrix) | CVodeSetJacFn(one->memory, jacobian);
    failed |= CVodeSetMaxOrd(one->memory, order) | CVodeSetStabLimDet(one->memory, detect_stability_limit);
    return failed ? NULL : one;
}

/* Write y at `end` and return the number of steps; -1 where CVODE gives up, or needs more than `most` steps. */
long frame_cvode_run(Integrator *one, double end, long most, double *y)
{
    double t;
    long steps;
    start(one);
    int failed = CVodeReInit(one->memory, 0.0, one->y) | CVodeSetMaxNumSteps(one->memory, most);
    if (failed || CVodeSetStopTime(one->memory, end) || CVode(one->memory, end, one->y, &t, 1) < 0) {
        return -1;
    }
    for (int i = 0; i < 2 * N; i++) {
        y[i] = N_VGetArrayPointer(one->y)[i];
    }
    return CVodeGetNumSteps(one->memory, &steps) ? -1 : steps;
}

#endif
