/* A part of a function as eomgen writes them: a loop reads tables and the workspace, and stores into the workspace.
 * GCC 12.2 leaves the call out at -O1 and -O2 if it may look into the part. */
#define EOMGEN_SHORT_NAMES
#include "eomgen_real.h"

static EG_NOINLINE void part(real *restrict w)
{
    {
        static const double table0[2] = {
            0.14, -0.14 };
        static const double table1[2] = {
            0.06, -0.06 };
        static const double table2[2] = {
            1.0, -1.0 };
        static const double table3[2] = {
            0.12, -0.12 };
        static const double table4[2] = {
            0.02, -0.02 };
        int k;
        for (k = 0; k < 2; ++k) {
            const real r3 = K(table0[k]);
            const real r7 = w[2801 + 166 * k];
            const real r8 = w[2839 + 166 * k];
            const real r12 = K(table1[k]);
            const real r13 = w[2808 + 166 * k];
            const real r46 = w[1476 + 124 * k];
            const real r47 = w[111 + 34 * k];
            const real r48 = w[109 + 34 * k];
            const real r49 = w[110 + 34 * k];
            const real r50 = w[2739 + 166 * k];
            const real r51 = w[1112 + 12 * k];
            const real r52 = w[1113 + 12 * k];
            const real r53 = w[2731 + 166 * k];
            const real r54 = w[1114 + 12 * k];
            const real r55 = w[2744 + 166 * k];
            const real r56 = w[1115 + 12 * k];
            const real r57 = w[1116 + 12 * k];
            const real r58 = w[1117 + 12 * k];
            const real r59 = w[1479 + 124 * k];
            const real r60 = w[98 + 34 * k];
            const real r61 = w[126 + 34 * k];
            const real r62 = w[123 + 34 * k];
            const real r63 = w[127 + 34 * k];
            const real r64 = w[128 + 34 * k];
            const real r65 = w[129 + 34 * k];
            const real r66 = K(table2[k]);
            const real r67 = w[1473 + 124 * k];
            const real r68 = w[96 + 34 * k];
            const real r69 = w[121 + 34 * k];
            const real r70 = w[122 + 34 * k];
            const real r71 = w[124 + 34 * k];
            const real r73 = w[1367 + 3 * k];
            const real r74 = w[2371 + 3 * k];
            const real r75 = w[1366 + 3 * k];
            const real r76 = w[1368 + 3 * k];
            const real r77 = w[2372 + 3 * k];
            const real r79 = w[1481 + 124 * k];
            const real r80 = w[1475 + 124 * k];
            const real r82 = w[2742 + 166 * k];
            const real r83 = w[2736 + 166 * k];
            const real r84 = w[2749 + 166 * k];
            const real r85 = w[1118 + 12 * k];
            const real r87 = w[1120 + 12 * k];
            const real r88 = w[1121 + 12 * k];
            const real r91 = K(table3[k]);
            const real r93 = w[1551 + 124 * k];
            const real r95 = w[97 + 34 * k];
            const real r104 = w[1980 + 91 * k];
            const real r106 = w[1273 - 3 * k];
            const real r115 = w[2013 + 91 * k];
            const real r121 = w[1989 + 91 * k];
            const real r131 = w[2016 + 91 * k];
            const real r195 = K(table4[k]);
            const real y1 = r3 * r7 + r8 + r12 * r13;
            w[3194 + 174 * k] = y1;
            const real y9 = r50 + r51 + r59 * r60 * r66;
            const real y10 = r53 - r54 + r59 * r62 * r66;
            w[3215 + 174 * k] = y10;
            const real y11 = r55 + r56 - r59 * r63 * r66;
            const real y12 = r67 * r68 + r73 - r66 * (r60 * r79);
            const real y13 = r67 * r70 - r75 + r66 * (r62 * r79);
            const real y14 = r62 * r67 + r76 + r66 * (r63 * r79);
            const real y15 = r68 * r80 + r82 - r66 * r85;
            const real y16 = r70 * r80 - r83 + r66 * r87;
            const real y17 = r62 * r80 + r84 + r66 * r88;
            const real y18 = r46 * r47 - r52 - r59 * r61 * r66;
            w[3223 + 174 * k] = -(y18 + (K(0.12) * y14 - K(0.06) * y17));
            const real y19 = r46 * r48 - r57 - r59 * r64 * r66;
            w[3224 + 174 * k] = -(y19 - (K(0.12) * y12 - K(0.06) * y15));
            const real y20 = r46 * r49 - r58 - r59 * r65 * r66;
            w[3225 + 174 * k] = -(y20 + (y13 * r91 - r12 * y16));
            const real y21 = r67 * r69 - r74 - r66 * (r61 * r79);
            w[3226 + 174 * k] = y21 + K(0.12) * y11;
            const real y22 = r67 * r71 - r77 - r66 * (r64 * r79);
            w[3227 + 174 * k] = y22 - K(0.12) * y9;
            const real y29 = r68 * r93 + r106;
            w[3234 + 174 * k] = y29;
            const real y38 = r95 * r104 - r115;
            const real y44 = r95 * r121 + r131;
            const real y54 = K(0.02) * y44;
            w[3365 + 174 * k] = y38 * r195 + y54;
        }
    }
}

void whole(real *w)
{
    part(w);
}
