void test_inverse(const real *q, const real *v, const real *D, real step, real *inverse);
void test_inverse(const real *q, const real *v, const real *D, real step, real *inverse)
{
    static tied_workspace work;
    const tied_parameters p = { 0.3 };
    const tied_coefficients c = tied_coefficients_of(0.9);
    int i;
    memcpy(work.q, q, sizeof work.q);
    memcpy(work.v, v, sizeof work.v);
    memcpy(work.increment, D, sizeof work.increment);
    tied_measure(&p, 0.0, &work);
    tied_iteration_matrix(&p, &c, 0.0, step, &work);
    for (i = 0; i < 7; ++i) {
        memcpy(work.right, inverse + 7 * i, sizeof work.solution);
        tied_solve_step(&work);
        memcpy(inverse + 7 * i, work.solution, sizeof work.solution);
    }
}
