/* A pointer that may be null. */
static void g(work *w, const real *u)
{
    int i;
    for (i = 0; i < 2; ++i) {
        const int held = u != NULL && u[i] == u[i];
        w->x[i] = held ? u[i] : K(0.5);
        if (w->n[i] > 1 || (held && u[i + 1] > w->x[2]))
            w->n[i] = 7;
    }
}
static void f(work *w)
{
    g(w, w->x + 3);
    g(w, NULL);
}
