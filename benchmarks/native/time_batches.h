/* Nanoseconds per call of anything: batches of at least 2 ms of thread CPU time, so that other users of the core do not count. */
#ifndef TIME_BATCHES_H
#define TIME_BATCHES_H

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { STATES = 64 }; /* random states that the calls cycle through, so that no branch or load is learnt by heart */

typedef void (*repeated_call)(long calls);

static double thread_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int ascending(const void *left, const void *right)
{
    const double x = *(const double *)left, y = *(const double *)right;
    return (x > y) - (x < y);
}

/* Print the median, the smallest and the 90th percentile of the batches, in ns per call. */
static void time_batches(repeated_call run, int batches)
{
    double *seconds = (double *)malloc((size_t)batches * sizeof *seconds);
    double start, taken;
    long calls = STATES;
    int batch;
    run(STATES);
    for (;;) {
        start = thread_seconds();
        run(calls);
        taken = thread_seconds() - start;
        if (taken >= 0.002) {
            break;
        }
        calls *= 2;
    }
    for (batch = 0; batch < batches; ++batch) {
        start = thread_seconds();
        run(calls);
        seconds[batch] = (thread_seconds() - start) / (double)calls * 1e9;
    }
    qsort(seconds, (size_t)batches, sizeof *seconds, ascending);
    printf("%.3f %.3f %.3f\n", seconds[batches / 2], seconds[0], seconds[batches * 9 / 10]);
    free(seconds);
}

/* Return all numbers of a file of doubles, which must hold `count` of them. */
static double *read_doubles(const char *path, size_t count)
{
    FILE *file = fopen(path, "rb");
    double *values = (double *)malloc((count + 1) * sizeof *values);
    if (file == NULL || fread(values, sizeof *values, count + 1, file) != count) {
        fprintf(stderr, "%s does not hold %lu doubles\n", path, (unsigned long)count);
        exit(2);
    }
    fclose(file);
    return values;
}

static void write_doubles(const char *path, const double *values, size_t count)
{
    FILE *file = fopen(path, "wb");
    if (file == NULL || fwrite(values, sizeof *values, count, file) != count || fclose(file) != 0) {
        fprintf(stderr, "cannot write %s\n", path);
        exit(2);
    }
}

#endif
