void run(double *flat, int samples)
{
    int s, i;
    for (s = 0; s < samples; ++s) {
        work w;
        for (i = 0; i < 6; ++i)
            w.x[i] = flat[s * 12 + i];
        for (i = 0; i < 4; ++i)
            w.n[i] = (long)flat[s * 12 + 6 + i];
        w.pair.high = flat[s * 12 + 10];
        w.pair.low = flat[s * 12 + 11];
        f(&w);
        for (i = 0; i < 6; ++i)
            flat[s * 12 + i] = w.x[i];
        for (i = 0; i < 4; ++i)
            flat[s * 12 + 6 + i] = (double)w.n[i];
        flat[s * 12 + 10] = w.pair.high;
        flat[s * 12 + 11] = w.pair.low;
    }
}
