# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The laboratory: studies around mlmem_ros, which it imports and which never imports it.

- `fit`, `plans`, `twins`: an individual element from its echoes, pulses for it, their worth.
- `landscapes`: the energy of a wall, and the wall as a particle.
- `designer`, `studies`: new elements; tolerance, proofs.
- `windows`, `reads`, `times`, `validity`, `forecasts`: counts of the presets.
- `paper`, `bench`: the paper's figures and claims; benchmarks.
- `lattices`, `measured`, `standard_problems`: chains of other laws, real ones.
- `results`, `tables`, `numbers`: result files, and their numbers in the pages.
"""
