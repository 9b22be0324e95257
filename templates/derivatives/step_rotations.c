/* Tangents of the exponential of rotating factors in steps.
 *
 * SPDX-License-Identifier: MIT
 * Part of eomgen; the same for all models.
 */

/* T and Ad(exp(-theta)) = 1 - ad(theta) T of rotating factors at theta, (nv) of each step. kind: 0: SO(3), 1: R^3 x SO(3),
 * 2: SE(3); turn as above. T and A: blocks of a step one behind the other. T of SO(3) is 1 - a X + b X^2, X the skew matrix
 * of the rotation; of SE(3), with Y that of the translation, its corner is the derivative of this along Y. */
EG_SEEN void eomgen_step_turning(long steps, long nv, long turns, const long *turn, const long *kind,
    const double *theta, double *A, double *T)
{
    long k, f, i, j, t;
    for (k = 0; k < steps; ++k, theta += nv)
        for (f = 0; f < turns; ++f) {
            const long size = turn[2 * f + 1];
            const double *w = theta + turn[2 * f], *u = w + 3, x = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
            const double X[9] = { 0.0, -w[2], w[1], w[2], 0.0, -w[0], -w[1], w[0], 0.0 };
            double a, b, da, db; /* da, db: derivatives by the angle over the angle */
            double Y[9] = { 0.0 };
            if (x < 0.25) { /* (1 - cos)/x, (angle - sin)/angle^3 and their derivatives as series */
                double term = 1.0;
                a = b = da = db = 0.0;
                for (i = 0; i < 9; ++i) {
                    const double n = 2.0 * (double)i, next = term * -x / ((n + 1.0) * (n + 2.0));
                    a += term / ((n + 1.0) * (n + 2.0));
                    b += term / ((n + 1.0) * (n + 2.0) * (n + 3.0));
                    da -= term * (n + 2.0) / ((n + 1.0) * (n + 2.0) * (n + 3.0) * (n + 4.0));
                    db -= term * (n + 2.0) / ((n + 1.0) * (n + 2.0) * (n + 3.0) * (n + 4.0) * (n + 5.0));
                    term = next;
                }
            } else {
                const double angle = sqrt(x), s = sin(angle), c = cos(angle);
                a = (1.0 - c) / x;
                b = (angle - s) / (x * angle);
                da = (s / angle - 2.0 * a) / x;
                db = (a - 3.0 * b) / x;
            }
            if (kind[f] == 2) {
                Y[1] = -u[2];
                Y[2] = u[1];
                Y[3] = u[2];
                Y[5] = -u[0];
                Y[6] = -u[1];
                Y[7] = u[0];
            }
            memset(T, 0, (size_t)(size * size) * sizeof *T);
            for (i = 0; i < 3; ++i)
                for (j = 0; j < 3; ++j) {
                    double square = 0.0, mixed = 0.0, along = 0.0;
                    for (t = 0; t < 3; ++t) {
                        square += X[3 * i + t] * X[3 * t + j];
                        mixed += X[3 * i + t] * Y[3 * t + j] + Y[3 * i + t] * X[3 * t + j];
                    }
                    T[i * size + j] = (double)(i == j) - a * X[3 * i + j] + b * square;
                    if (kind[f] == 2) {
                        along = w[0] * u[0] + w[1] * u[1] + w[2] * u[2];
                        T[(3 + i) * size + 3 + j] = T[i * size + j];
                        T[(3 + i) * size + j] = -a * Y[3 * i + j] + b * mixed + along * (db * square - da * X[3 * i + j]);
                    } else if (kind[f] == 1)
                        T[(3 + i) * size + 3 + j] = (double)(i == j);
                }
            for (i = 0; i < size; ++i)
                for (j = 0; j < size; ++j) {
                    double product = 0.0;
                    for (t = 0; t < 3; ++t)
                        if (i < 3)
                            product += X[3 * i + t] * T[t * size + j];
                        else if (kind[f] == 2)
                            product += Y[3 * (i - 3) + t] * T[t * size + j] + X[3 * (i - 3) + t] * T[(3 + t) * size + j];
                    A[i * size + j] = (double)(i == j) - product;
                }
            T += size * size;
            A += size * size;
        }
}
