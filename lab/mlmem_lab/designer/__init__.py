# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a number of levels to a design with the settings of its instrument.

`propose_design` finds a candidate by rules and closed forms; `studies.proof` simulates it.
"""

from .proposal import DesignNotFound, Proposal, propose_design

__all__ = ['DesignNotFound', 'Proposal', 'propose_design']
