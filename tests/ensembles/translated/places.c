static const int order[4] = { 2, 0, 3, 1 };
static const real share[3] = { K(0.25), -K(0.5), 1.0 };
static void f(work *w)
{
    int i, best = 0, count = 0, found[4];
    real y[6];
    for (i = 1; i < 6; ++i)
        if (EG_ABS(w->x[i]) > EG_ABS(w->x[best]))
            best = i;
    for (i = 0; i < 4; ++i) {
        found[i] = 0;
        if (w->x[order[i]] > K(0.0))
            found[count++] = order[i];
    }
    memcpy(y, w->x, sizeof y);
    w->x[best] = w->x[0];
    w->x[0] = y[best] * K(share[1]);
    w->n[3] = count;
    w->n[0] = found[count > 0 ? count - 1 : 0];
    if (best > 2)
        memcpy(w->x + 1, y + 2, 2 * sizeof *y);
    w->x[5] = w->x[found[0]] + share[best % 3];
}
