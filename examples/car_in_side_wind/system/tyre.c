/* Combined slip of a tyre: two magic formulas and a friction ellipse (Pacejka, Tire and Vehicle Dynamics, 2012). */
#include <math.h>

/* Argument of the arc tangent in a magic formula. */
static inline double magic_inner(double x, double b)
{
    const double e = 0.3;
    return b * x - e * (b * x - atan(b * x));
}

/* Magic formula. The functions of forces are called more often than the partials, so slopes are apart. */
static inline double magic(double x, double b, double c)
{
    return sin(c * atan(magic_inner(x, b)));
}

/* Slope of a magic formula, and its value. */
static inline double magic_slope(double x, double b, double c, double *value)
{
    const double e = 0.3, s = magic_inner(x, b), angle = c * atan(s);
    *value = sin(angle);
    return cos(angle) * c / (1.0 + s * s) * (b - e * (b - b / (1.0 + b * b * x * x)));
}

/* Arguments: longitudinal slip, slip angle in rad, load in N. Parameters: friction, stiffness. Results: forces in N. */
void tyre(const double *arguments, const double *parameters, double *results)
{
    const double load = arguments[2], mu = parameters[0], stiffness = parameters[1];
    const double x = magic(arguments[0], stiffness, 1.6), y = magic(arguments[1], 0.8 * stiffness, 1.3);
    const double weight = sqrt(1.0 - 0.5 * y * y * x * x);
    results[0] = mu * load * x * weight;
    results[1] = -mu * load * y * weight;
}

/* Row by row: results by arguments. */
void tyre_partials(const double *arguments, const double *parameters, double *partials)
{
    const double load = arguments[2], mu = parameters[0], stiffness = parameters[1];
    double x, y;
    const double dx = magic_slope(arguments[0], stiffness, 1.6, &x);
    const double dy = magic_slope(arguments[1], 0.8 * stiffness, 1.3, &y);
    const double weight = sqrt(1.0 - 0.5 * y * y * x * x);
    const double by_x = -0.5 * y * y * x / weight, by_y = -0.5 * y * x * x / weight;
    partials[0] = mu * load * (weight + x * by_x) * dx;
    partials[1] = mu * load * x * by_y * dy;
    partials[2] = mu * x * weight;
    partials[3] = -mu * load * y * by_x * dx;
    partials[4] = -mu * load * (weight + y * by_y) * dy;
    partials[5] = -mu * y * weight;
}
