static void rotate(const real *q, real s, const real *x, real *y) /* R x for s = 1, R^T x for s = -1 */
{
    real e[3];
    e[0] = K(2.0) * (q[2] * x[2] - q[3] * x[1]);
    e[1] = K(2.0) * (q[3] * x[0] - q[1] * x[2]);
    e[2] = K(2.0) * (q[1] * x[1] - q[2] * x[0]);
    y[0] = x[0] + s * q[0] * e[0] + (q[2] * e[2] - q[3] * e[1]);
    y[1] = x[1] + s * q[0] * e[1] + (q[3] * e[0] - q[1] * e[2]);
    y[2] = x[2] + s * q[0] * e[2] + (q[1] * e[1] - q[2] * e[0]);
}
static void spring(const real *q, real *f) /* force on the body, body axes */
{
    real force[3];
    force[0] = K(-40.0) * (q[4] - q[7]);
    force[1] = K(-40.0) * q[5];
    force[2] = K(-40.0) * q[6];
    rotate(q, K(-1.0), force, f);
}
void tied_inputs(real t, real *u) { EG_SINCOS(K(3.0) * t, u, u + 1); }
void tied_residual(const tied_parameters *p, const real *q, const real *v, const real *a, const real *u, real *r)
{
    real f[3];
    spring(q, f);
    r[0] = a[0] + v[1] * v[2];
    r[1] = K(2.0) * a[1] - K(2.0) * v[0] * v[2];
    r[2] = K(3.0) * a[2] + v[0] * v[1];
    r[3] = K(2.0) * (a[3] + v[1] * v[5] - v[2] * v[4]) - f[0];
    r[4] = K(2.0) * (a[4] + v[2] * v[3] - v[0] * v[5]) - f[1];
    r[5] = K(2.0) * (a[5] + v[0] * v[4] - v[1] * v[3]) - f[2];
    r[6] = K(0.5) * a[6] - K(40.0) * (q[4] - q[7]) + p->p_damping * v[6] - u[0] - K(0.25) * u[1];
}
void tied_partials(const tied_parameters *p, const real *q, const real *v, real *dq, real *dv, real *M)
{
    const real axis[3] = { K(1.0), K(0.0), K(0.0) };
    real f[3], e[3];
    int i;
    spring(q, f);
    rotate(q, K(-1.0), axis, e);
    for (i = 0; i < 49; ++i) dq[i] = dv[i] = M[i] = K(0.0);
    M[0] = K(1.0); M[8] = K(2.0); M[16] = K(3.0); M[24] = M[32] = M[40] = K(2.0); M[48] = K(0.5);
    dv[1] = v[2]; dv[2] = v[1];
    dv[7] = K(-2.0) * v[2]; dv[9] = K(-2.0) * v[0];
    dv[14] = v[1]; dv[15] = v[0];
    /* -m ~U and m ~omega */
    dv[22] = K(2.0) * v[5]; dv[23] = K(-2.0) * v[4];
    dv[28] = K(-2.0) * v[5]; dv[30] = K(2.0) * v[3];
    dv[35] = K(2.0) * v[4]; dv[36] = K(-2.0) * v[3];
    dv[25] = K(-2.0) * v[2]; dv[26] = K(2.0) * v[1];
    dv[31] = K(2.0) * v[2]; dv[33] = K(-2.0) * v[0];
    dv[38] = K(-2.0) * v[1]; dv[39] = K(2.0) * v[0];
    dv[48] = p->p_damping;
    /* -~f, k I, -k R^T e and -k e^T R, k */
    dq[22] = f[2]; dq[23] = -f[1];
    dq[28] = -f[2]; dq[30] = f[0];
    dq[35] = f[1]; dq[36] = -f[0];
    for (i = 0; i < 3; ++i) {
        dq[(3 + i) * 7 + 3 + i] = K(40.0);
        dq[(3 + i) * 7 + 6] = K(-40.0) * e[i];
        dq[6 * 7 + 3 + i] = K(-40.0) * e[i];
    }
    dq[48] = K(40.0);
}
