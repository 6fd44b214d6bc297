# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An individual element: fitted to the echoes of a survey, planned for, and watched.

- `forward`, `tangent`, `noise`, `unknowns`: what both ends do after a pulse, and its derivatives.
- `misfit`, `descent`, `fit`, `fitted`, `trusted`: from the shots of a survey to every cell.
- `kick_search`, `plan`: pulses that write the fitted element.
- `watching`, `monitor_node`: reads of a running element beside their forecast.
"""
