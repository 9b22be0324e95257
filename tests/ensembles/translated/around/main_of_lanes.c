void run(double *flat, int samples)
{
    int s, i, lane;
    for (s = 0; s < samples; s += EG_LANES) {
        work w;
        eg_wholes here = EG_WHOLES(0);
        for (lane = 0; lane < EG_LANES; ++lane) {
            const double *row = flat + (s + lane) * 12;
            here[lane] = (s + lane) % 7 == 3 ? 0 : -1;
            for (i = 0; i < 6; ++i)
                w.x[i][lane] = row[i];
            for (i = 0; i < 4; ++i)
                w.n[i][lane] = (long)row[6 + i];
            w.pair.high[lane] = row[10];
            w.pair.low[lane] = row[11];
        }
        f(here, &w);
        for (lane = 0; lane < EG_LANES; ++lane) {
            double *row = flat + (s + lane) * 12;
            for (i = 0; i < 6; ++i)
                row[i] = w.x[i][lane];
            for (i = 0; i < 4; ++i)
                row[6 + i] = (double)w.n[i][lane];
            row[10] = w.pair.high[lane];
            row[11] = w.pair.low[lane];
        }
    }
}
