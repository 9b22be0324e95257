/* Two FMUs of FMI 2.0 in one program, linked statically by their prefixes: both step, and the plant goes back by a
 * copy. Prints the last angle. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FMI2_FUNCTION_PREFIX plant_
#include "fmi2Functions.h"

#define plant(name) plant_fmi2##name
#define controller(name) controller_fmi2##name
fmi2InstantiateTYPE controller_fmi2Instantiate;
fmi2SetupExperimentTYPE controller_fmi2SetupExperiment;
fmi2EnterInitializationModeTYPE controller_fmi2EnterInitializationMode;
fmi2ExitInitializationModeTYPE controller_fmi2ExitInitializationMode;
fmi2DoStepTYPE controller_fmi2DoStep;
fmi2GetRealTYPE controller_fmi2GetReal;
fmi2SetRealTYPE controller_fmi2SetReal;
fmi2FreeInstanceTYPE controller_fmi2FreeInstance;

enum { STEPS = 50 };

static void check(fmi2Status status, const char *what)
{
    if (status != fmi2OK) {
        fprintf(stderr, "%s: status %d\n", what, (int)status);
        exit(1);
    }
}

static void logger(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status, fmi2String category,
    fmi2String message, ...)
{
    va_list arguments;
    (void)environment; (void)instance; (void)status; (void)category;
    va_start(arguments, message);
    vfprintf(stderr, message, arguments);
    va_end(arguments);
}

int main(void)
{
    const fmi2CallbackFunctions calls = { logger, calloc, free, NULL, NULL };
    const fmi2ValueReference measured[2] = { PLANT_ANGLE, PLANT_SPEED }, asked[1] = { CONTROLLER_COMMAND };
    const fmi2ValueReference inputs[2] = { CONTROLLER_ANGLE, CONTROLLER_SPEED }, torque[1] = { PLANT_TORQUE };
    fmi2Component one = plant(Instantiate)("one", fmi2CoSimulation, PLANT_TOKEN, "", &calls, 0, 1);
    fmi2Component two = controller(Instantiate)("two", fmi2CoSimulation, CONTROLLER_TOKEN, "", &calls, 0, 1);
    fmi2FMUstate state = NULL;
    double values[2], command[1], angle, again;
    int k;
    if (one == NULL || two == NULL)
        return 2;
    check(plant(SetupExperiment)(one, 0, 0.0, 0.0, 0, 0.0), "set up");
    check(controller(SetupExperiment)(two, 0, 0.0, 0.0, 0, 0.0), "set up");
    check(plant(EnterInitializationMode)(one), "enter");
    check(controller(EnterInitializationMode)(two), "enter");
    check(plant(ExitInitializationMode)(one), "exit");
    check(controller(ExitInitializationMode)(two), "exit");
    for (k = 0; k < STEPS; ++k) {
        check(plant(GetReal)(one, measured, 2, values), "get");
        check(controller(GetReal)(two, asked, 1, command), "get");
        check(controller(SetReal)(two, inputs, 2, values), "set");
        check(plant(SetReal)(one, torque, 1, command), "set");
        check(controller(DoStep)(two, 1e-3 * k, 1e-3, 0), "step");
        check(plant(DoStep)(one, 1e-3 * k, 1e-3, 0), "step");
    }
    check(plant(GetFMUstate)(one, &state), "state");
    check(plant(DoStep)(one, 1e-3 * STEPS, 1e-3, 0), "step");
    check(plant(GetReal)(one, measured, 1, &angle), "get");
    check(plant(SetFMUstate)(one, state), "state");
    check(plant(DoStep)(one, 1e-3 * STEPS, 1e-3, 0), "step");
    check(plant(GetReal)(one, measured, 1, &again), "get");
    check(plant(FreeFMUstate)(one, &state), "free");
    plant(FreeInstance)(one);
    controller(FreeInstance)(two);
    if (memcmp(&angle, &again, sizeof angle) != 0)
        return 5;
    printf("%.17g\n", angle);
    return 0;
}
