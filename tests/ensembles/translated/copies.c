static void fill(work *w, const real *from, int much)
{
    if (much)
        memset(w->x + 3, 0, 2 * sizeof *w->x);
    memcpy(w->x, from, 2 * sizeof *from);
}
static void f(work *w)
{
    work before = *w, next = *w;
    const real *origin = NULL;
    if (w->x[0] > K(0.0)) {
        const real half = next.x[4] * K(0.5);
        next.x[4] = half;
        next.x[1] = half + K(3.0);
        fill(&next, next.x + 2, next.n[0] > 0);
        *w = next;
    } else if (w->x[1] > K(0.0)) {
        w->pair = before.pair;
        w->pair.low = w->pair.high = K(4.0);
    }
    w->n[2] = memcmp(before.x, w->x, sizeof before.x) == 0;
    if (origin != NULL)
        w->x[0] = origin[0];
    w->n[3] = (long)(w->x[5] * K(10.0));
    w->x[4] = (real)w->n[3] - K(0.5);
}
