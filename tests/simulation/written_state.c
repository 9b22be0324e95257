#include <stdio.h>
#include "NAME.h"
int main(void)
{
    static NAME_simulator run, again;
    int k;
    NAME_simulator_default(&run);
    if (NAME_simulator_start(&run, NULL) != 0 || NAME_simulator_step(&run, 20, NULL, NULL) != 0)
        return 1;
    again = run;
    for (k = 0; k < 2; ++k) {
        NAME_simulator *one = k == 0 ? &run : &again;
        one->state.q[0] += 0.3;
        one->state.v[0] = -0.5;
        if (k == 1 && NAME_simulator_start(one, NULL) != 0)
            return 2;
        if (NAME_simulator_step(one, 50, NULL, NULL) != 0)
            return 3;
        printf("%.17g %.17g\n", one->state.q[0], one->state.v[0]);
    }
    again = run;
    if (NAME_simulator_step(&run, -5, NULL, NULL) == 0 || NAME_simulator_step(&run, 0, NULL, NULL) == 0)
        return 4;
    if (NAME_simulator_step(&run, 3, NULL, NULL) != 0 || NAME_simulator_step(&again, 3, NULL, NULL) != 0)
        return 5;
    return run.state.q[0] == again.state.q[0] && run.state.t > 0.0 ? 0 : 6;
}
