# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""All studies: the data figures of the paper, and ours where print and physics are compared."""

from __future__ import annotations

from collections.abc import Iterable

from .figure import Study

STUDIES = (
    Study('1c', 'fig_1c', 'Fig. 1c: potential, stiffness and wall profiles', 1),
    Study('2a', 'fig_2a', 'Fig. 2a: energy landscape under strain, Eq. 3 and without ansatz', 3),
    Study('2b', 'fig_2b', 'Fig. 2b: position of a pinned wall under growing strain', 5),
    Study('2c', 'fig_2c', 'Fig. 2c: stiffness of the substrate', 1),
    Study('3a', 'fig_3a', 'Fig. 3a: wavenumbers of both phases', 1),
    Study('3b', 'fig_3b', 'Fig. 3b: a pulse and its echo from the wall', 2),
    Study('4a', 'fig_4a', 'Fig. 4a: the wall driven from level to level', 3),
    Study('4b', 'fig_4b', 'Fig. 4b: echo delay by level', 1),
    Study('5', 'fig_5', 'Fig. 5: erase by a kink, from every level', 4),
    Study('s1', 'mov_s1', 'Mov. S1: the walls moving under strain', 13),
    Study('gradient', 'gradient', 'A wall in the uniform gradient: speed and profile', 3),
    Study('carriers', 'carriers', 'Which carriers and thresholds return an echo', 9),
    Study('peaks', 'peaks', 'Which peak strains move the wall by one level', 8),
    Study('launches', 'launches', 'Which launches start a wall, the printed one included', 11),
    Study('rigidity', 'rigidity', 'How stiff the substrate has to be', 10),
    Study('design', 'design', 'How the pieces of a design act together', 1),
    Study('retention', 'retention', 'Which shaking of the base loses a level', 65),
    Study('fast', 'fast_write', 'How fast a write can be, and how far its peaks may be off', 700),
    Study('energy', 'energy_use', 'The energy of a write, and where it becomes heat', 30),
    Study('check', 'check', 'The independent check: SciPy, closed forms, Newton', 15),
)

BY_NAME = {study.name: study for study in STUDIES}


def select(names: Iterable[str]) -> list[Study]:
    """Return the named studies in the order of the paper; all of them for no name.

    Args:
        names: As a person types them: '2b', 'fig_2b', 'Fig. 2b', '2B'.

    Raises:
        KeyError: There is no such study; the message lists those that are.
    """
    wanted = []
    for name in names:
        key = name.lower().removeprefix('fig').lstrip('._ ').removeprefix('mov_')
        if key not in BY_NAME:
            raise KeyError(f'figure must be one of {", ".join(BY_NAME)}; got {name!r}')
        wanted.append(key)
    return [study for study in STUDIES if not wanted or study.name in wanted]
