#include <complex>
#include <cstdio>
#include "model/pendulum.h"
using namespace std;
using std::real;
static double K(double x) { return 2.0 * x; }
int main() {
    pendulum_parameters p;
    pendulum_default_parameters(&p);
    double q[PENDULUM_NQ] = {0.5}, M[PENDULUM_NV * PENDULUM_NV] = {0.0};
    pendulum_mass(MASS_ARGUMENTS);
    printf("%.17g %g", M[0], K(real(complex<double>(1.5, 2.0))));
}
