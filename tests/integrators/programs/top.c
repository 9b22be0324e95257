static void gravity(const real *q, real *g) /* m R^T (0, 0, -9.81) */
{
    const real f = K(15.0) * K(-9.81);
    g[0] = f * K(2.0) * (q[1] * q[3] - q[0] * q[2]);
    g[1] = f * K(2.0) * (q[2] * q[3] + q[0] * q[1]);
    g[2] = f * (K(1.0) - K(2.0) * (q[1] * q[1] + q[2] * q[2]));
}
void top_residual(const real *q, const real *v, const real *a, real *r)
{
    real g[3];
    gravity(q, g);
    r[0] = K(15.234375) * a[0] + (K(15.234375) - K(0.46875)) * v[1] * v[2] - g[2];
    r[1] = K(0.46875) * a[1];
    r[2] = K(15.234375) * a[2] + (K(0.46875) - K(15.234375)) * v[0] * v[1] + g[0];
}
void top_partials(const real *q, const real *v, real *dq, real *dv, real *M)
{
    const real d = K(15.234375) - K(0.46875);
    real g[3];
    int i;
    gravity(q, g);
    for (i = 0; i < 9; ++i) dq[i] = dv[i] = M[i] = K(0.0);
    M[0] = M[8] = K(15.234375);
    M[4] = K(0.46875);
    dv[1] = d * v[2];
    dv[2] = d * v[1];
    dv[6] = -d * v[1];
    dv[7] = -d * v[0];
    /* -~X ~g with X = e2 */
    dq[0] = g[1];
    dq[1] = -g[0];
    dq[7] = -g[2];
    dq[8] = g[1];
}
void top_forward_dynamics(const real *q, const real *v, real *vdot)
{
    const real zero[3] = { K(0.0), K(0.0), K(0.0) };
    real r[3];
    top_residual(q, v, zero, r);
    vdot[0] = -r[0] / K(15.234375);
    vdot[1] = -r[1] / K(0.46875);
    vdot[2] = -r[2] / K(15.234375);
}
