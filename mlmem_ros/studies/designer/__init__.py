# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a number of levels to a design with the settings of its instrument, and its proof.

`propose` finds a candidate by rules and closed forms, `Proof` simulates it: every level is
written and read back, written downward, and erased.
"""

from .proof import Proof, Tally
from .search import DesignNotFound, Proposal, propose

__all__ = ['DesignNotFound', 'Proof', 'Proposal', 'Tally', 'propose']
