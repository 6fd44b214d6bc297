/* Copyright 2026 The mlmem_ros authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The yardstick: Eq. (1a) over a rigid substrate by PEFRL, as one would write it in C, for
 * gcc -O3 -march=native -ffast-math, which takes the vector sine of libmvec. The same steps as
 * mlmem/physics/pefrl.py without a driven end. Displacements have a ghost cell at either end.
 */
#include <math.h>

/* A kick at displacements x, then a drift to y. */
static void kick_and_drift(long n, double *restrict x, double *restrict y, double *restrict v,
                           const double *restrict height, const double *restrict shape, double V_N,
                           double a, double b, double c, double decay, double kick, double drift)
{
    x[0] = x[1];
    x[n + 1] = x[n];
    for (long j = 0; j < n; j++) {
        double D = x[j + 1] - V_N * shape[j] + c, D2 = D * D;
        double on_site = height[j] * sin(D * (a + b * D2)) * (a + 3.0 * b * D2);
        v[j] = decay * v[j] + kick * (x[j] - 2.0 * x[j + 1] + x[j + 2] - on_site);
        y[j + 1] = x[j + 1] + drift * v[j];
    }
}

void advance_rigid(long steps, long n, double *restrict x, double *restrict y, double *restrict v,
                   const double *restrict height, const double *restrict shape,
                   const double *restrict V_N, double a, double b, double c,
                   const double *restrict drifts, const double *restrict decay,
                   const double *restrict kick)
{
    for (long i = 0; i < 4 * steps; i += 4) {
        for (long j = 0; j < n; j++)
            x[j + 1] += drifts[0] * v[j];
        for (long stage = 0; stage < 4; stage++) {
            long inner = stage == 1 || stage == 2;
            kick_and_drift(n, stage % 2 ? y : x, stage % 2 ? x : y, v, height, shape,
                           V_N[i + stage], a, b, c, decay[inner], kick[inner], drifts[stage + 1]);
        }
    }
}
