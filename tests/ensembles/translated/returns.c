static int root(real x, real *y)
{
    if (!(x >= K(0.0)))
        return 2;
    *y = EG_SQRT(x);
    if (*y > K(1.0))
        return 1;
    *y = K(1.0) - *y;
    return 0;
}
static real larger(real x, real y) { return x > y ? x : y; }
static void f(work *w)
{
    const int status = root(w->x[0], &w->x[1]);
    int i;
    w->n[0] = status;
    if (status == 2)
        return;
    for (i = 0; i < 3; ++i) {
        if (w->x[2 + i] < K(-1.0))
            return;
        w->x[2 + i] = larger(w->x[2 + i], w->x[1]);
        if (root(w->x[2 + i], &w->pair.high) == 0 && root(w->pair.high, &w->pair.low) != 1)
            w->n[1] = w->n[1] + 1;
    }
    w->n[2] = 100;
}
