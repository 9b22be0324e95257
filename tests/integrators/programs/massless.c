#include <stdio.h>
#include <stdlib.h>
#define EOMGEN_SHORT_NAMES
#include "pair.h"
static pair_workspace work;
int main(int argc, char **argv)
{
    const double steps = atof(argv[1]), off = atof(argv[2]);
    pair_parameters p;
    pair_settings settings;
    pair_state state;
    double k;
    pair_default_parameters(&p);
    p.p_light = 0.0;
    pair_default_settings(&settings);
    settings.step = 3.0 / steps;
    DAMPED
    pair_default_state(&state);
    state.q[1] = off;
    if (argc != 4 || pair_initialize(&p, &settings, &state, &work, NULL) != PAIR_OK)
        return 1;
    for (k = 0; k < steps; k += 1.0) {
        if (pair_step(&p, &settings, &state, &work, NULL) != PAIR_OK)
            return 2;
        printf("%.17g %.17g %.17g\n", state.t, state.q[0], state.q[1]);
    }
    return 0;
}
