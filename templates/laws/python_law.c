/* A prototype in Python, for runs from Python alone: this file is not exported. The two pointers are the only variables
 * outside of functions in code by eomgen; the loader sets the pointers once, before the first call. */
#include <math.h>

typedef void function_in_python(const double *arguments, const double *parameters, double *results);
static function_in_python *values_in_python, *slopes_in_python;

__attribute__((visibility("default"))) void {setter}(function_in_python *values, function_in_python *slopes);
void {setter}(function_in_python *values, function_in_python *slopes)
{{
    values_in_python = values;
    slopes_in_python = slopes;
}}

static void call(function_in_python *function, const double *arguments, const double *parameters, double *results,
    int size)
{{
    int i;
    for (i = 0; i < size; ++i)
        results[i] = NAN; /* stays after an error in Python */
    if (function)
        function(arguments, parameters, results);
}}

void {setter}_values({arguments})
{{
    call(values_in_python, arguments, parameters, results, {values});
}}

void {setter}_slopes({arguments})
{{
    call(slopes_in_python, arguments, parameters, results, {slopes});
}}
