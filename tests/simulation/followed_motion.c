#include <math.h>
#include <stdio.h>
#include "followed.h"
int main(void)
{
    static followed_simulator run;
    int k;
    followed_simulator_default(&run);
    run.settings.step = 1e-3;
    if (followed_simulator_start(&run, NULL) != FOLLOWED_OK)
        return 1;
    for (k = 0; k < 100; ++k) {
        const double t = 1e-3 * k, s = t + 1e-3, T = 1e-3;
        const double x = t * t * t, v = 3.0 * t * t, a = 6.0 * t, X = s * s * s, V = 3.0 * s * s, A = 6.0 * s;
        SNIPPET
    }
    printf("%.17g %.17g %.17g\n", run.state.q[0], run.state.v[0], run.state.vdot[0]);
    return 0;
}
