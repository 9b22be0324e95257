/* memory is the integral; it gives up where the angle is too large */
int law(double t, const double *signals, double *values, double *memory)
{
    memory[0] += 0.02 * signals[0];
    values[0] = -8.0 * signals[0] - 3.0 * memory[0] + 0.1 * t;
    return signals[0] > 0.9 ? 7 : 0;
}
