#include <stdio.h>
#include "NAME.h"
static int row(NAME_simulator *run)
{
    eomgen_real y[64];
    int i;
    if (NAME_simulator_outputs(run, y) != NAME_OK)
        return 1;
    for (i = 0; i < SIZE; ++i)
        printf("%.17g ", (double)y[i]);
    printf("\n");
    return 0;
}
int main(void)
{
    static NAME_simulator run;
    eomgen_real y[64];
    int k;
    NAME_simulator_default(&run);
    run.settings.step = STEP;
    if (NAME_simulator_outputs(&run, y) != NAME_BAD_ARGUMENT) /* not started */
        return 1;
    if (NAME_simulator_start(&run, FIRST) != NAME_OK || row(&run) != 0)
        return 2;
    for (k = 0; k < 20; ++k) {
        BEFORE
        if (NAME_simulator_step(&run, 2, FROM, UNTIL) != NAME_OK || row(&run) != 0)
            return 3;
    }
    run.state.v[0] += 0.1;
    if (NAME_simulator_outputs(&run, y) != NAME_BAD_ARGUMENT) /* written, and not started again */
        return 4;
    return NAME_simulator_start(&run, FIRST) == NAME_OK && NAME_simulator_outputs(&run, y) == NAME_OK ? 0 : 5;
}
