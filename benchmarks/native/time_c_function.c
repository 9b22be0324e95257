/* Evaluates or times one function of generated C.
 *
 *     time_c_function results STATES RESULTS      one row of results for each state
 *     time_c_function time STATES BATCHES         ns per call
 *
 * call.h, written for each function, defines WIDTH and SIZE, the doubles in a state and in a result, and
 * evaluate(state, result), which is compiled into the loop below; the function itself is in another translation unit.
 */
#define _POSIX_C_SOURCE 199309L
#include <string.h>

#include "time_batches.h"

#include "call.h"

static double *states;
static double result[SIZE];

static void run(long calls)
{
    long call;
    for (call = 0; call < calls; ++call) {
        evaluate(states + call % STATES * WIDTH, result);
    }
}

int main(int count, char **words)
{
    if (count != 4) {
        return 2;
    }
    states = read_doubles(words[2], (size_t)STATES * WIDTH);
    if (strcmp(words[1], "time") == 0) {
        time_batches(run, atoi(words[3]));
    } else {
        double *rows = (double *)calloc((size_t)STATES * SIZE, sizeof *rows);
        int state;
        for (state = 0; state < STATES; ++state) {
            evaluate(states + state * WIDTH, rows + state * SIZE);
        }
        write_doubles(words[3], rows, (size_t)STATES * SIZE);
    }
    return 0;
}
