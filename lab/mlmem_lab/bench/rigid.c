/* Copyright 2026 The mlmem_ros authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * The yardstick: Eq. (1a) over a rigid substrate by Noh-Bathe, as one would write it in C, for
 * gcc -O3 -march=native -ffast-math, which takes the vector sine of libmvec. The same steps as
 * mlmem/physics/methods/noh_bathe.py without a driven end. u and u_p have a ghost cell at
 * either end.
 */
#include <math.h>

#define ON_SITE(x, j)                                                        \
    ({ double y = (x) - V_N[i] * shape[j] + c, y2 = y * y;                   \
       height[j] * sin(y * (a + b * y2)) * (a + 3.0 * b * y2); })

void advance_rigid(long steps, long n, double *restrict u, double *restrict v,
                   double *restrict A, double *restrict u_p, double *restrict v_p,
                   double *restrict A_p, const double *restrict height,
                   const double *restrict shape, const double *restrict V_N, double eta,
                   double a, double b, double c, const double *restrict k)
{
    const double a0 = k[0], a1 = k[1], a2 = k[2], a3 = k[3];
    const double a4 = k[4], a5 = k[5], a6 = k[6], a7 = k[7];

    for (long j = 0; j < n; j++)
        u_p[j + 1] = u[j + 1] + a0 * v[j] + a1 * A[j];
    for (long i = 0; i < 2 * steps; i++) {
        u_p[0] = u_p[1];
        u_p[n + 1] = u_p[n];
        for (long j = 0; j < n; j++) {
            double x = u_p[j + 1];
            double f = u_p[j] - 2.0 * x + u_p[j + 2] - ON_SITE(x, j) - eta * (v[j] + a0 * A[j]);
            double w = v[j] + a2 * (A[j] + f);
            A_p[j] = f;
            v_p[j] = w;
            u[j + 1] = x + a3 * w + a4 * f;
        }
        i++;
        u[0] = u[1];
        u[n + 1] = u[n];
        for (long j = 0; j < n; j++) {
            double x = u[j + 1];
            double f = u[j] - 2.0 * x + u[j + 2] - ON_SITE(x, j) - eta * (v_p[j] + a3 * A_p[j]);
            double w = v_p[j] + a5 * A[j] + a6 * A_p[j] + a7 * f;
            A[j] = f;
            v[j] = w;
            u_p[j + 1] = x + a0 * w + a1 * f;
        }
    }
}
