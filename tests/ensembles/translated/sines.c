/* Sine and cosine into memory of the caller. */
static void f(work *w)
{
    if (w->x[0] > K(0.0))
        EG_SINCOS(w->x[1], &w->x[2], w->x + 3);
    if (w->x[4] > K(0.0))
        EG_SINCOS(w->x[5], &w->pair.high, &w->pair.low);
}
