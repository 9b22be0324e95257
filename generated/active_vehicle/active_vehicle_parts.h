/* active_vehicle_parts.h: the parts of long functions, and loops, private to the model.
 *
 * SPDX-License-Identifier: MIT
 */
#ifndef ACTIVE_VEHICLE_PARTS_H
#define ACTIVE_VEHICLE_PARTS_H

#include "active_vehicle.h"

void active_vehicle_loop1(const eomgen_real *restrict g, eomgen_real *restrict r);
void active_vehicle_partials_part1(const active_vehicle_parameters *p, const eomgen_real *q, const eomgen_real *v,
    eomgen_real *restrict w, eomgen_real *restrict K, eomgen_real *restrict C, eomgen_real *restrict M);
void active_vehicle_partials_part2(const active_vehicle_parameters *p, const eomgen_real *v, const eomgen_real *a,
    eomgen_real *restrict w, eomgen_real *restrict K, eomgen_real *restrict C, eomgen_real *restrict M);

#endif
