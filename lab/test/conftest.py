# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The environment of the laboratory's tests, also where they run alone."""

import os

# Before numpy is loaded: our matrices are small, and BLAS threads wait for each other.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')
