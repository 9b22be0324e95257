/* Combined slip of a tyre: two magic formulas and a friction ellipse (Pacejka, Tire and Vehicle Dynamics, 2012). */
#include <math.h>

/* Magic formula and its slope. */
static double magic(double x, double b, double c, double *slope)
{
    const double e = 0.3, s = b * x - e * (b * x - atan(b * x));
    const double ds = b - e * (b - b / (1.0 + b * b * x * x));
    *slope = cos(c * atan(s)) * c / (1.0 + s * s) * ds;
    return sin(c * atan(s));
}

/* Arguments: longitudinal slip, slip angle in rad, load in N. Parameters: friction, stiffness. Results: forces in N. */
void tyre(const double *arguments, const double *parameters, double *results)
{
    const double load = arguments[2], mu = parameters[0], stiffness = parameters[1];
    double slope;
    const double x = magic(arguments[0], stiffness, 1.6, &slope), y = magic(arguments[1], 0.8 * stiffness, 1.3, &slope);
    const double weight = sqrt(1.0 - 0.5 * y * y * x * x);
    results[0] = mu * load * x * weight;
    results[1] = -mu * load * y * weight;
}

/* Row by row: results by arguments. */
void tyre_partials(const double *arguments, const double *parameters, double *partials)
{
    const double load = arguments[2], mu = parameters[0], stiffness = parameters[1];
    double dx, dy;
    const double x = magic(arguments[0], stiffness, 1.6, &dx), y = magic(arguments[1], 0.8 * stiffness, 1.3, &dy);
    const double weight = sqrt(1.0 - 0.5 * y * y * x * x);
    const double by_x = -0.5 * y * y * x / weight, by_y = -0.5 * y * x * x / weight;
    partials[0] = mu * load * (weight + x * by_x) * dx;
    partials[1] = mu * load * x * by_y * dy;
    partials[2] = mu * x * weight;
    partials[3] = -mu * load * y * by_x * dx;
    partials[4] = -mu * load * (weight + y * by_y) * dy;
    partials[5] = -mu * y * weight;
}
