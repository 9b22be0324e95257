/* A choice by a common number, whose cases run on, into memory of the caller. */
static void sums(int k, const real *x, real *out)
{
    real sum = K(0.5);
    switch (k) {
    case 4: sum = sum + x[3];
    case 3: sum = sum + x[2] * K(2.0);
    case 2: sum = sum * x[1];
    default: ;
    }
    out[0] = sum + x[0];
}
static void f(work *w)
{
    int k;
    for (k = 1; k < 6; ++k) {
        real part[2];
        sums(k, w->x, part);
        w->x[5] = w->x[5] + part[0];
    }
    if (w->x[1] > K(0.5)) {
        real part[1];
        sums(3, w->x, part);
        w->x[4] = part[0];
    }
}
