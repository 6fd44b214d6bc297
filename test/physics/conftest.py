# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Let these tests import the `oracle` that lies beside them."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent))
