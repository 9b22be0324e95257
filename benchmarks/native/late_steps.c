/* The time of each step of a compiled stepper, and of an empty loop as long in turns with it, by the processor's counter:
 * what the empty loop is late by, is the machine's. */
#if !defined(__x86_64__)
#define _POSIX_C_SOURCE 199309L
#include <time.h>
#endif
#include <stdint.h>

typedef int (*Run)(const double *, const double *, double *, double *, long, long, const double *, double *, long *);

/* Counts of a constant rate: of the time stamp counter, after all that stands before; elsewhere nanoseconds. */
uint64_t late_ticks(void)
{
#if defined(__x86_64__)
    __builtin_ia32_lfence();
    uint64_t now = __builtin_ia32_rdtsc();
    __builtin_ia32_lfence();
    return now;
#else
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1000000000u * (uint64_t)now.tv_sec + (uint64_t)now.tv_nsec;
#endif
}

/* Each turn waits for the one before. */
static uint64_t idle(long turns, uint64_t x)
{
    for (long k = 0; k < turns; k++) {
        x = x * 6364136223846793005u + 1442695040888963407u;
    }
    return x;
}

/* Write the ticks of `count` steps, whose inputs are `row` numbers on in the table, and of as many empty loops between
 * them. Return the status of the step that failed, 0 where none did. */
int late_steps(uintptr_t run, const double *p, const double *settings, double *state, double *workspace, long count,
               const double *inputs, long row, long turns, uint32_t *stepped, uint32_t *empty)
{
    Run step = (Run)run;
    volatile uint64_t kept = 1;
    for (long k = 0; k < count; k++) {
        long recorded;
        uint64_t began = late_ticks();
        int status = step(p, settings, state, workspace, 1, 0, inputs ? inputs + k * row : 0, 0, &recorded);
        uint64_t between = late_ticks();
        kept = idle(turns, kept);
        uint64_t ended = late_ticks();
        stepped[k] = (uint32_t)(between - began);
        empty[k] = (uint32_t)(ended - between);
        if (status) {
            return status;
        }
    }
    return 0;
}
