void edge_residual(const edge_parameters *p, real t, const real *q, const real *a, real *r)
{
    r[0] = p->p_mass * a[0] + K(400.0) * EG_SIN(q[0]) + K(0.0) * EG_SQRT(p->p_last_time - t);
}
void edge_partials(const edge_parameters *p, const real *q, real *dq, real *M)
{
    dq[0] = p->p_stiffness * EG_COS(q[0]);
    M[0] = p->p_mass;
}
