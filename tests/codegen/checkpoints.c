#include <stdio.h>
#include <string.h>
#include "NAME.h"

static NAME_workspace work;
static NAME_state state;

static int advance(const NAME_parameters *p, const NAME_settings *s, int steps)
{
    NAME_status status = NAME_OK;
    while (steps-- > 0 && status == NAME_OK)
        status = NAME_step(p, s, &state, &work, NULL);
    return (int)status;
}

/* run FILE: 80 steps, a checkpoint after 30; resume FILE: the last 50 of them.
   Both print the bytes of the state at the end. */
int main(int argc, char **argv)
{
    NAME_parameters p;
    NAME_settings s;
    FILE *file = argc == 3 ? fopen(argv[2], strcmp(argv[1], "run") == 0 ? "wb" : "rb") : NULL;
    size_t done, k;
    if (file == NULL)
        return 1;
    NAME_default_parameters(&p);
    NAME_default_settings(&s);
    if (strcmp(argv[1], "run") == 0) {
        NAME_default_state(&state);
        if (NAME_initialize(&p, &s, &state, &work, NULL) != NAME_OK || advance(&p, &s, 30) != 0)
            return 2;
        done = fwrite(&state, sizeof state, 1, file) + fwrite(&work, sizeof work, 1, file);
    } else {
        done = fread(&state, sizeof state, 1, file) + fread(&work, sizeof work, 1, file);
    }
    fclose(file);
    if (done != 2 || advance(&p, &s, 50) != 0)
        return 3;
    for (k = 0; k < sizeof state; ++k)
        printf("%02x", ((const unsigned char *)&state)[k]);
    printf(" %ld\n", state.count);
    return 0;
}
