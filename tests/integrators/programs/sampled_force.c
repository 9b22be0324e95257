#include <math.h>
#include <stdio.h>
#include "free_mass.h"

int main(void)
{
    static free_mass_workspace work;
    static free_mass_state state;
    free_mass_parameters p;
    free_mass_settings settings;
    const double h = 1e-3;
    double q = 0.0, v = 0.0, wrong_q = 0.0, wrong_v = 0.0;
    unsigned long random = 1;
    eomgen_real table[5] = {0};
    int k;
    free_mass_default_parameters(&p);
    free_mass_default_settings(&settings);
    free_mass_default_state(&state);
    settings.step = h;
    if (free_mass_initialize(&p, &settings, &state, &work, table) != FREE_MASS_OK)
        return 1;
    for (k = 0; k < 2000; ++k) {
        random = (random * 1103515245UL + 12345UL) % 2147483648UL;
        const double force = 200.0 * ((double)random / 2147483648.0) - 100.0;
        if (k == 1000)
            p.p_m = 10.0;
        table[0] = table[1] = table[2] = table[3] = table[4] = force;
        if (free_mass_step(&p, &settings, &state, &work, table) != FREE_MASS_OK)
            return 2;
        q += h * (v + 0.5 * h * force / p.p_m);
        v += h * force / p.p_m;
        wrong_q = fmax(wrong_q, fabs(q - state.q[0]));
        wrong_v = fmax(wrong_v, fabs(v - state.v[0]));
    }
    printf("%g %g %ld %ld %.17g\n", wrong_q, wrong_v, state.count, state.statistics.steps, state.t);
    return 0;
}
