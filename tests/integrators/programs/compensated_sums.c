#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#define EOMGEN_SHORT_NAMES
#include "oscillator.h"
static oscillator_workspace work;
int main(int argc, char **argv)
{
    const long steps = atol(argv[2]);
    const int forget = atoi(argv[3]);
    oscillator_parameters p;
    oscillator_settings settings;
    oscillator_state state;
    long k;
    oscillator_default_parameters(&p);
    oscillator_default_settings(&settings);
    settings.step = (eomgen_real)(atof(argv[1]) / (double)steps);
    oscillator_default_state(&state);
    state.q[0] = 1;
    if (argc != 4 || oscillator_initialize(&p, &settings, &state, &work, NULL) != OSCILLATOR_OK)
        return 1;
    for (k = 0; k < steps; ++k) {
        if (oscillator_step(&p, &settings, &state, &work, NULL) != OSCILLATOR_OK)
            return 2;
        if (forget) {
            memset(state.q_remainder, 0, sizeof state.q_remainder);
            memset(state.v_remainder, 0, sizeof state.v_remainder);
        }
    }
    printf("%.17g %.17g\n", (double)state.q[0], (double)state.v[0]);
    return 0;
}
