#include <stdio.h>
#include "cart.h"
static int control(void *context, int controller, double t, const double *signals, double *values, double *memory)
{
    *(int *)context += 1 + controller;
    (void)t;
    memory[1] += 0.01 * signals[0];
    values[0] = signals[2] * signals[0] - 6.0 * (signals[1] - memory[0]) / 0.01 + 3.0 * memory[1];
    memory[0] = signals[1];
    return 0;
}
int main(void)
{
    static cart_simulator s;
    int calls = 0, without;
    cart_simulator_default(&s);
    cart_simulator_start(&s, NULL);
    s.settings.step = 0.003;
    without = (int)cart_simulator_step(&s, 1, NULL, NULL);
    s.settings.control = control;
    s.settings.context = &calls;
    if (cart_simulator_step(&s, 250, NULL, NULL) != CART_OK)
        return 1;
    printf("%d %d %.17g\n", without == CART_CONTROLLER_FAILED, calls, s.state.q[0]);
    return 0;
}
