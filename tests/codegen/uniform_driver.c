/* Written once for every model: evaluates all functions, then takes steps. */
#include <stdio.h>
#include <stdlib.h>
#include "eomgen_uniform.h"

extern const eomgen_model MODEL;

int main(int argc, char **argv)
{
    const eomgen_model *const m = &MODEL;
    const long steps = argc > 1 ? atol(argv[1]) : 0;
    const double step = argc > 2 ? atof(argv[2]) : 0.0;
    eomgen_real *block[EOMGEN_BLOCKS], *out;
    eomgen_arguments given = { 0 };
    void *run;
    double number;
    int k, i, status;

    for (k = 0; k < EOMGEN_BLOCKS; ++k)
        block[k] = calloc((size_t)m->size[k] + 1, sizeof(eomgen_real));
    m->initial(block[EOMGEN_BLOCK_Q], block[EOMGEN_BLOCK_V], block[EOMGEN_BLOCK_Z]);
    m->defaults(block[EOMGEN_BLOCK_P]);
    while (scanf("%d %d %lf", &k, &i, &number) == 3) /* array, place, number */
        block[k][i] = (eomgen_real)number;
    given.t = block[EOMGEN_BLOCK_T][0];
    given.p = block[EOMGEN_BLOCK_P];
    given.q = block[EOMGEN_BLOCK_Q];
    given.v = block[EOMGEN_BLOCK_V];
    given.a = block[EOMGEN_BLOCK_A];
    given.z = block[EOMGEN_BLOCK_Z];
    given.lam = block[EOMGEN_BLOCK_LAM];
    if (argc > 3)
        given.u = block[EOMGEN_BLOCK_U];
    for (k = 0; k < m->functions; ++k) {
        const eomgen_function *const f = &m->function[k];
        out = calloc((size_t)f->size + 1, sizeof *out);
        status = f->call(&given, out);
        printf("%s,%d", f->name, status);
        for (i = 0; i < f->size && status == EOMGEN_OK; ++i)
            printf(",%.17g", (double)out[i]);
        printf("\n");
        free(out);
    }
    run = malloc(m->simulator_size + 1);
    out = calloc((size_t)m->outputs + 1, sizeof *out);
    given.t = 0;
    given.q = given.v = given.z = NULL;
    status = steps > 0 ? m->start(run, &given, (eomgen_real)step) : 1;
    for (; status == EOMGEN_OK; status = m->step(run, 1, given.u, NULL)) {
        const double t = (double)m->state(run, block[EOMGEN_BLOCK_Q], block[EOMGEN_BLOCK_V], block[EOMGEN_BLOCK_Z]);
        if (t > ((double)steps + 0.5) * step)
            break;
        printf("%.17g", t);
        for (k = 0; k < 3; ++k) {
            static const int kept[] = { EOMGEN_BLOCK_Q, EOMGEN_BLOCK_V, EOMGEN_BLOCK_Z };
            for (i = 0; i < m->size[kept[k]]; ++i)
                printf(",%.17g", (double)block[kept[k]][i]);
        }
        if (m->output != NULL && m->output(run, out) != EOMGEN_OK)
            return 3;
        for (i = 0; i < m->outputs; ++i)
            printf(",%.17g", (double)out[i]);
        printf("\n");
    }
    if (steps > 0 && status != EOMGEN_OK)
        fprintf(stderr, "%s\n", m->status_text(status));
    for (k = 0; k < EOMGEN_BLOCKS; ++k)
        free(block[k]);
    free(out);
    free(run);
    return steps > 0 && status != EOMGEN_OK ? 2 : 0;
}
