/* Two FMUs of FMI 3.0 in one program, linked statically by their prefixes: 64 instances of each on 8 threads step, go
 * back by copies and by bytes, and end at the same numbers. Prints the last outputs. */
#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FMI3_FUNCTION_PREFIX plant_
#include "fmi3Functions.h"

#define plant(name) plant_fmi3##name
#define controller(name) controller_fmi3##name
fmi3InstantiateCoSimulationTYPE controller_fmi3InstantiateCoSimulation;
fmi3EnterInitializationModeTYPE controller_fmi3EnterInitializationMode;
fmi3ExitInitializationModeTYPE controller_fmi3ExitInitializationMode;
fmi3DoStepTYPE controller_fmi3DoStep;
fmi3GetFloat64TYPE controller_fmi3GetFloat64;
fmi3SetFloat64TYPE controller_fmi3SetFloat64;
fmi3FreeInstanceTYPE controller_fmi3FreeInstance;

enum { STEPS = 50, INSTANCES = 64, THREADS = 8 };
static double ends[INSTANCES];

static void check(fmi3Status status, const char *what)
{
    if (status != fmi3OK) {
        fprintf(stderr, "%s: status %d\n", what, (int)status);
        exit(1);
    }
}

static double step_both(fmi3Instance one, fmi3Instance two, int k)
{
    const fmi3ValueReference measured[2] = { PLANT_ANGLE, PLANT_SPEED }, asked[1] = { CONTROLLER_COMMAND };
    const fmi3ValueReference inputs[2] = { CONTROLLER_ANGLE, CONTROLLER_SPEED }, torque[1] = { PLANT_TORQUE };
    fmi3Boolean event, terminate, early;
    double values[2], command[1], last;
    check(plant(GetFloat64)(one, measured, 2, values, 2), "get");
    check(controller(GetFloat64)(two, asked, 1, command, 1), "get");
    check(controller(SetFloat64)(two, inputs, 2, values, 2), "set");
    check(plant(SetFloat64)(one, torque, 1, command, 1), "set");
    check(controller(DoStep)(two, 1e-3 * k, 1e-3, fmi3False, &event, &terminate, &early, &last), "step");
    check(plant(DoStep)(one, 1e-3 * k, 1e-3, fmi3False, &event, &terminate, &early, &last), "step");
    return last;
}

static double motion(void)
{
    fmi3Instance one = plant(InstantiateCoSimulation)("one", PLANT_TOKEN, NULL, fmi3False, fmi3False, fmi3False,
        fmi3False, NULL, 0, NULL, NULL, NULL);
    fmi3Instance two = controller(InstantiateCoSimulation)("two", CONTROLLER_TOKEN, NULL, fmi3False, fmi3False,
        fmi3False, fmi3False, NULL, 0, NULL, NULL, NULL);
    const fmi3ValueReference measured[1] = { PLANT_ANGLE };
    fmi3FMUState state = NULL, other = NULL;
    fmi3Byte *bytes;
    size_t size;
    fmi3Boolean event, terminate, early;
    double angle, again, last;
    int k;
    if (one == NULL || two == NULL)
        exit(2);
    check(plant(EnterInitializationMode)(one, fmi3False, 0.0, 0.0, fmi3False, 0.0), "enter");
    check(controller(EnterInitializationMode)(two, fmi3False, 0.0, 0.0, fmi3False, 0.0), "enter");
    check(plant(ExitInitializationMode)(one), "exit");
    check(controller(ExitInitializationMode)(two), "exit");
    for (k = 0; k < STEPS; ++k)
        step_both(one, two, k);
    check(plant(GetFMUState)(one, &state), "state");
    check(plant(SerializedFMUStateSize)(one, state, &size), "size");
    bytes = (fmi3Byte *)malloc(size);
    check(plant(SerializeFMUState)(one, state, bytes, size), "bytes");
    check(plant(DoStep)(one, 1e-3 * STEPS, 1e-3, fmi3False, &event, &terminate, &early, &last), "step");
    check(plant(GetFloat64)(one, measured, 1, &angle, 1), "get");
    check(plant(DeserializeFMUState)(one, bytes, size, &other), "bytes");
    check(plant(SetFMUState)(one, other), "state");
    check(plant(DoStep)(one, 1e-3 * STEPS, 1e-3, fmi3False, &event, &terminate, &early, &last), "step");
    check(plant(GetFloat64)(one, measured, 1, &again, 1), "get");
    if (memcmp(&angle, &again, sizeof angle) != 0)
        exit(5);
    check(plant(FreeFMUState)(one, &state), "free");
    check(plant(FreeFMUState)(one, &other), "free");
    free(bytes);
    plant(FreeInstance)(one);
    controller(FreeInstance)(two);
    return angle;
}

static void *work(void *first)
{
    int k;
    for (k = (int)(size_t)first; k < INSTANCES; k += THREADS)
        ends[k] = motion();
    return NULL;
}

int main(void)
{
    pthread_t threads[THREADS];
    int k;
    for (k = 0; k < THREADS; ++k)
        if (pthread_create(&threads[k], NULL, work, (void *)(size_t)k) != 0)
            return 3;
    for (k = 0; k < THREADS; ++k)
        pthread_join(threads[k], NULL);
    for (k = 1; k < INSTANCES; ++k)
        if (memcmp(&ends[k], &ends[0], sizeof ends[0]) != 0)
            return 4;
    printf("%.17g\n", ends[0]);
    return 0;
}
