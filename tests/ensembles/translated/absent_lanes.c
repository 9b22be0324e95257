/* Memory of the caller in which lanes that are not there have numbers. */
static void change(const real *x, real *out)
{
    out[0] = out[0] + x[1];
    if (x[3] > K(0.0))
        out[1] = x[2];
}
static void filled(const real *x, real *out) { change(x, out); }
static void f(work *w)
{
    real kept[2];
    kept[0] = w->x[0];
    kept[1] = w->x[1];
    filled(w->x, kept);
    if (w->x[2] > K(0.1))
        filled(w->x + 2, kept);
    w->x[3] = kept[0];
    w->x[4] = kept[1];
}
