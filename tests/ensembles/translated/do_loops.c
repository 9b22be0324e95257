/* A loop whose condition stands behind it. */
static void f(work *w)
{
    int turns = 0, last = 0;
    do {
        ++turns;
        if (w->x[1] > K(2.0))
            break;
        w->x[1] = w->x[1] + fabs(w->x[2]) + K(0.1);
        if (turns == w->n[1])
            continue;
        w->x[2] = floor(w->x[2] * K(3.0)) / K(2.0) - K(0.25);
        last = turns >= w->n[0];
    } while (!last && w->x[0] > (real)turns - K(3.0));
    w->n[2] = turns;
    do {
        w->x[3] = w->x[3] + K(0.5);
        --turns;
    } while (0);
}
