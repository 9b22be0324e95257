/* Quadratic drag: the force in N at a velocity in m/s, with a coefficient in N s^2/m^2. */
void drag(const double *arguments, const double *parameters, double *results)
{
    const double u = arguments[0];
    results[0] = -parameters[0] * u * (u < 0.0 ? -u : u);
}
