/* A function of one trajectory, called for one lane after another; sine and cosine. */
int law(double x, double *y);
static void f(work *w)
{
    real y[2];
    y[0] = w->x[0];
    y[1] = w->x[1];
    if (w->x[2] > K(0.0)) {
        real sine, cosine;
        w->n[0] = law(w->x[3], y);
        EG_SINCOS(y[0], &sine, &cosine);
        w->x[3] = sine + K(2.0) * cosine;
    }
    w->x[4] = y[0];
    w->x[5] = y[1];
}
