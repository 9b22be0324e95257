static int steps(real start, real end, work *w)
{
    int count;
    for (count = 0; start < end; ++count) {
        if (w->n[0] == count)
            continue;
        start = start + K(0.25);
        if (count > 5)
            break;
        w->x[count % 3] = w->x[count % 3] + start;
    }
    return count;
}
static void f(work *w)
{
    int i, j;
    real sum = K(0.0);
    w->n[1] = steps(w->x[3], w->x[4], w);
    for (i = 0; i < 4 && sum < K(2.0); ++i)
        for (j = 0; j <= i; ++j) {
            if (w->x[j] > K(1.5))
                break;
            sum = sum + w->x[i] * w->x[j];
        }
    w->x[5] = sum;
    while (w->n[2] > 1 && w->x[0] < K(3.0)) {
        w->n[2] = w->n[2] / 2;
        w->x[0] = w->x[0] + K(0.5);
    }
}
