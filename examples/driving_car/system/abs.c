/* Brakes of four wheels, front left, front right, rear left, rear right, every 5 ms. A wheel that loses speed fast, or
 * slips by more than 0.15, is released; one that comes back is held; else its torque follows the pedal. Both rear
 * wheels take the smaller torque of the two. Signals: speed of the car, m/s, speeds of rolling of the wheels, m/s,
 * pedal from 0 to 1, and 1 with this control or 0 without. Values: torques, N m. Memory: speeds of rolling, and 1
 * after the first release. */
int abs_control(double t, const double *signals, double *values, double *memory)
{
    static const double most[4] = {2000.0, 2000.0, 800.0, 800.0};
    const double period = 0.005, speed = signals[0], pedal = signals[5];
    int i;
    (void)t;
    for (i = 0; i < 4; i++) {
        const double rolling = signals[1 + i], wanted = pedal * most[i];
        const double slip = 1.0 - rolling / (speed > 1.0 ? speed : 1.0);
        const double gained = (rolling - memory[i]) / period;
        double torque = values[i];
        memory[i] = rolling;
        if (signals[6] < 0.5 || speed < 3.0) {
            torque = wanted;
        } else if (slip > 0.15 || (gained < -30.0 && slip > 0.02)) {
            torque -= 8000.0 * period;
            memory[4 + i] = 1.0;
        } else if (gained < 6.0 && slip < 0.1) {
            torque += (memory[4 + i] > 0.5 ? 1500.0 : 20000.0) * period;
        }
        values[i] = torque < 0.0 ? 0.0 : torque > wanted ? wanted : torque;
    }
    if (signals[6] > 0.5) {
        values[2] = values[3] = values[2] < values[3] ? values[2] : values[3];
    }
    return 0;
}
