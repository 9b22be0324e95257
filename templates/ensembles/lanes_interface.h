/* Functions of a library of lanes, which driver.c.jinja implements and Python calls.
 *
 * SPDX-License-Identifier: MIT
 */
long eomgen_lanes_size(int kind);
void eomgen_lanes_start(const double *parameters, const double *settings, const double *inputs, const double *start,
    double *state, double *workspace, int *statuses);
void eomgen_lanes_run(const double *parameters, const double *settings, const double *inputs, double *state,
    double *workspace, long steps, long rows, double *record, int *statuses);
void eomgen_lanes_groups(const double *parameters, const double *settings, const double *inputs,
    const double *table, const double *starts, double *state, double *workspace, long groups, long steps, long rows,
    long rest, double shorter, double *record, double *modes, double *flat, int *statuses);
void eomgen_lanes_state(const double *state, double *flat);
