# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The laboratory: studies around mlmem_ros, which it imports and which never imports it.

- `study`: one runner for every count, by the functions below.
- `reads`, `words`, `shaken`: proofs of reads, sound and with faults.
- `robust_writes`, `robust_losses`, `times`: writes. `validity`, `forecasts`: where the model ends.
- `twins`: what fits of individual elements, and twins beside them, are worth.
- `windows`: how far kicks may be off.
- `designer`, `studies`: new elements; tolerance, and proofs of designs.
- `paper`, `bench`: the paper's figures, energies of walls and claims; benchmarks.
- `measured`, `standard_problems`: real lattices, and answers for authors of other codes.
- `results`, `tables`, `numbers`: result files, and their numbers in the pages.
"""
