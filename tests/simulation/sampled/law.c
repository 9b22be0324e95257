/* A law of the test: memory is the last measurement and the integral. */
int servo_law(double t, const double *signals, double *values, double *memory)
{
    const double error = signals[0], measured = signals[1], stiffness = signals[2];
    memory[1] += 0.01 * error;
    values[0] = stiffness * error - 6.0 * (measured - memory[0]) / 0.01 + 3.0 * memory[1];
    memory[0] = measured;
    return t < 0.0;
}
