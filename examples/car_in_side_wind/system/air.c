/* Coefficients of the air on a car by a table of a wind tunnel: cubic B-splines over side-slip and wing. */
#include <math.h>

enum { results_count = 4, angles = 9, openings = 6 };

/* Coefficients of B-splines; rows every 10 degrees from -40 to 40, columns at wing openings of -0.5, -0.1, ... 1.5, so that
 * the table covers -30 to 30 degrees and openings of -0.1 to 1.1. */
static const double table[results_count][angles][openings] = {
    /* drag */
    {
        { 1.140, 1.302, 1.464, 1.627, 1.789, 1.951 },
        { 0.862, 1.004, 1.146, 1.288, 1.431, 1.573 },
        { 0.663, 0.791, 0.919, 1.047, 1.175, 1.303 },
        { 0.543, 0.663, 0.782, 0.902, 1.021, 1.141 },
        { 0.503, 0.620, 0.737, 0.853, 0.970, 1.087 },
        { 0.543, 0.663, 0.782, 0.902, 1.021, 1.141 },
        { 0.663, 0.791, 0.919, 1.047, 1.175, 1.303 },
        { 0.862, 1.004, 1.146, 1.288, 1.431, 1.573 },
        { 1.140, 1.302, 1.464, 1.627, 1.789, 1.951 },
    },
    /* side */
    {
        { -1.607, -1.671, -1.736, -1.800, -1.864, -1.928 },
        { -1.250, -1.300, -1.350, -1.400, -1.450, -1.500 },
        { -0.855, -0.889, -0.923, -0.958, -0.992, -1.026 },
        { -0.434, -0.451, -0.469, -0.486, -0.504, -0.521 },
        { 0.000, 0.000, 0.000, 0.000, 0.000, 0.000 },
        { 0.434, 0.451, 0.469, 0.486, 0.504, 0.521 },
        { 0.855, 0.889, 0.923, 0.958, 0.992, 1.026 },
        { 1.250, 1.300, 1.350, 1.400, 1.450, 1.500 },
        { 1.607, 1.671, 1.736, 1.800, 1.864, 1.928 },
    },
    /* yaw */
    {
        { -0.379, -0.345, -0.310, -0.276, -0.241, -0.207 },
        { -0.333, -0.303, -0.273, -0.242, -0.212, -0.182 },
        { -0.247, -0.225, -0.202, -0.180, -0.157, -0.135 },
        { -0.132, -0.120, -0.108, -0.096, -0.084, -0.072 },
        { 0.000, 0.000, 0.000, 0.000, 0.000, 0.000 },
        { 0.132, 0.120, 0.108, 0.096, 0.084, 0.072 },
        { 0.247, 0.225, 0.202, 0.180, 0.157, 0.135 },
        { 0.333, 0.303, 0.273, 0.242, 0.212, 0.182 },
        { 0.379, 0.345, 0.310, 0.276, 0.241, 0.207 },
    },
    /* down */
    {
        { 0.366, 0.549, 0.691, 0.793, 0.854, 0.874 },
        { 0.468, 0.703, 0.885, 1.015, 1.093, 1.119 },
        { 0.542, 0.812, 1.023, 1.173, 1.264, 1.294 },
        { 0.585, 0.878, 1.106, 1.268, 1.366, 1.398 },
        { 0.600, 0.900, 1.133, 1.300, 1.400, 1.433 },
        { 0.585, 0.878, 1.106, 1.268, 1.366, 1.398 },
        { 0.542, 0.812, 1.023, 1.173, 1.264, 1.294 },
        { 0.468, 0.703, 0.885, 1.015, 1.093, 1.119 },
        { 0.366, 0.549, 0.691, 0.793, 0.854, 0.874 },
    },
};

/* Four B-splines that are not zero, and their slopes; returns the number of the first. Beyond the table the edge holds. */
static int splines(double place, int count, double *values, double *slopes)
{
    const double last = count - 2.0, held = place < 1.0 ? 1.0 : place > last ? last : place;
    const int first = held < last ? (int)held - 1 : count - 4;
    const double s = held - (first + 1), r = 1.0 - s, moves = place == held ? 1.0 : 0.0;
    values[0] = r * r * r / 6.0;
    values[1] = (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0;
    values[2] = (4.0 - 6.0 * r * r + 3.0 * r * r * r) / 6.0;
    values[3] = s * s * s / 6.0;
    slopes[0] = moves * -0.5 * r * r;
    slopes[1] = moves * (1.5 * s * s - 2.0 * s);
    slopes[2] = moves * (2.0 * r - 1.5 * r * r);
    slopes[3] = moves * 0.5 * s * s;
    return first;
}

static const double pi = 3.14159265358979323846;

/* Results and their slopes along side-slip (rad) and opening. */
static void looked_up(const double *arguments, double *values, double *slopes)
{
    double by_angle[4], angle_slopes[4], by_opening[4], opening_slopes[4];
    const double angle = arguments[0] * (18.0 / pi) + 4.0, opening = 2.5 * arguments[1] + 1.25;
    const int row = splines(angle, angles, by_angle, angle_slopes);
    const int column = splines(opening, openings, by_opening, opening_slopes);
    int k, i, j;
    for (k = 0; k < results_count; ++k) {
        values[k] = slopes[2 * k] = slopes[2 * k + 1] = 0.0;
        for (i = 0; i < 4; ++i) {
            for (j = 0; j < 4; ++j) {
                const double c = table[k][row + i][column + j];
                values[k] += c * by_angle[i] * by_opening[j];
                slopes[2 * k] += c * angle_slopes[i] * by_opening[j] * (18.0 / pi);
                slopes[2 * k + 1] += c * by_angle[i] * opening_slopes[j] * 2.5;
            }
        }
    }
}

/* Arguments: side-slip of the air in rad, opening of the wing. Results: drag, side force, yawing moment, downforce. */
void air(const double *arguments, const double *parameters, double *results)
{
    double slopes[2 * results_count];
    (void)parameters;
    looked_up(arguments, results, slopes);
}

/* Row by row: results by arguments. */
void air_partials(const double *arguments, const double *parameters, double *partials)
{
    double values[results_count];
    (void)parameters;
    looked_up(arguments, values, partials);
}
