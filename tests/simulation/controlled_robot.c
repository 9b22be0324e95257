#include <stdio.h>
#include "NAME.h"

int main(void)
{
    static NAME_simulator run, copy;
    const double target[6] = { TARGET }, stiffness[6] = { STIFFNESS }, damping[6] = { DAMPING };
    double torque[6];
    int i, k;
    NAME_simulator_default(&run);
    if (NAME_simulator_start(&run, NULL) == 0)
        return 3; /* there are no formulas for the inputs */
    for (i = 0; i < 6; ++i)
        torque[i] = 0.0;
    if (NAME_simulator_start(&run, torque) != 0)
        return 4;
    for (k = 0; k < 1000; ++k) {
        for (i = 0; i < 6; ++i)
            torque[i] = stiffness[i] * (target[i] - run.state.q[i]) - damping[i] * run.state.v[i];
        if (k == 500) {
            copy = run;
            if (NAME_simulator_step(&copy, 7, torque, NULL) != 0)
                return 5;
        }
        if (NAME_simulator_step(&run, 1, torque, NULL) != 0)
            return 6;
    }
    for (i = 0; i < 6; ++i)
        printf("%.17g %.17g\n", run.state.q[i], run.state.v[i]);
    return 0;
}
