int main(void)
{
    static const long sizes[] = { INPUT_SIZES }, results[] = { RESULT_SIZES }, counts[] = { 8, 11, 12, 16, 17, 31 };
    enum { INPUTS = sizeof sizes / sizeof sizes[0], OUTPUTS = sizeof results / sizeof results[0] };
    long c, k, j;
    for (c = 0; c < 6; ++c) {
        const double *inputs[INPUTS];
        double *outputs[OUTPUTS];
        for (k = 0; k < INPUTS; ++k) {
            double *rows = malloc((size_t)(counts[c] * sizes[k]) * sizeof *rows);
            for (j = 0; j < counts[c] * sizes[k]; ++j)
                rows[j] = 0.5;
            inputs[k] = rows;
        }
        for (k = 0; k < OUTPUTS; ++k)
            outputs[k] = malloc((size_t)(counts[c] * results[k]) * sizeof(double));
        if (eomgen_call(FUNCTION, counts[c], inputs, sizes, outputs) != 0)
            return 1;
        for (k = 0; k < INPUTS; ++k)
            free((void *)inputs[k]);
        for (k = 0; k < OUTPUTS; ++k)
            free(outputs[k]);
    }
    return 0;
}
