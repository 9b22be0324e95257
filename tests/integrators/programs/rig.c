#include <stdio.h>
#include <stdlib.h>
#define EOMGEN_SHORT_NAMES
#include "rig.h"
static rig_workspace work;
int main(int argc, char **argv)
{
    const double step = atof(argv[1]), share = atof(argv[3]);
    const long steps = atol(argv[2]);
    rig_parameters p;
    rig_settings settings;
    rig_state state;
    double q[1], v[1], u[2];
    long k;
    rig_default_parameters(&p);
    p.p_share = share;
    rig_default_settings(&settings);
    settings.step = step;
    rig_default_state(&state);
    u[0] = -(1.0 - share) * state.q[0];
    if (rig_initialize(&p, &settings, &state, &work, u) != RIG_OK || argc != 4)
        return 1;
    for (k = 0; k < steps; ++k) {
        if (rig_predict(&p, &settings, &state, &work, u, q, v) != RIG_OK)
            return 2;
        u[1] = -(1.0 - share) * q[0]; /* what the rig answers at the predicted place */
        if (rig_step(&p, &settings, &state, &work, u) != RIG_OK)
            return 3;
        u[0] = u[1];
        printf("%.17g %.17g %.17g\n", state.t, state.q[0], state.v[0]);
    }
    return 0;
}
