# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""No part of the device finds walls: what it knows of them, it has heard at the ends."""

import ast
from functools import cache
from pathlib import Path

import mlmem
from mlmem.physics import wall

WALL = wall.__name__
ROOT = Path(mlmem.__file__).parent

RESEARCH = ('physics', 'simulation', 'parameter_sweep')
"""What uses the true wall: the material, and simulations without a device."""

FILES = [
    file
    for file in sorted(ROOT.rglob('*.py'))
    if file.relative_to(ROOT).with_suffix('').parts[0] not in RESEARCH and file.stem != '__init__'
]


@cache
def imported(source):
    """Return what a file imports from the package, at once, late or for type checkers only."""
    here = source.relative_to(ROOT.parent).parts[:-1]
    found = set()
    for node in ast.walk(ast.parse(source.read_text(encoding='utf-8'))):
        if isinstance(node, ast.ImportFrom):
            above = here[: len(here) - node.level + 1] if node.level else ()
            parts = (*above, *filter(None, (node.module or '').split('.')))
            found |= {
                '.'.join((*parts[1:], each.name))
                for each in node.names
                if parts[:1] == (ROOT.name,)
            }
    return found


def called(node):
    """Return the functions that a statement calls by a plain name."""
    calls = (each.func for each in ast.walk(node) if isinstance(each, ast.Call))
    return {function.id for function in calls if isinstance(function, ast.Name)}


def test_no_part_of_the_device_finds_walls():
    """It imports neither the module that finds them nor a name of it; see also test_blindfold.

    But for equilibria that it forecasts: there it makes sure where walls rest.
    """
    found = {name for name in vars(wall) if getattr(vars(wall)[name], '__module__', '') == WALL}
    assert found >= {'find_walls', 'find_level', 'Wall'}
    found.discard('wall_energy')  # of a design: it sees no element
    for source in FILES:
        names = imported(source)
        if source.stem == 'register':
            names = names - {'physics.find_walls'}
            tree = ast.parse(source.read_text(encoding='utf-8'))
            finders = [each.name for each in tree.body if 'find_walls' in called(each)]
            assert finders == ['pin_walls', 'find_wall_levels']
            users = [each.name for each in tree.body if 'find_wall_levels' in called(each)]
            assert users == ['pin_walls', 'find_off_level_states']
        assert 'readers.register.find_wall_levels' not in names, source
        assert not {name.rpartition('.')[2] for name in names} & found, source
        assert not [name for name in names if f'mlmem.{name}.'.startswith(f'{WALL}.')], source


def test_imports_are_found():
    element = imported(ROOT / 'element.py')
    assert element >= {
        'memory.Memory',
        'factory',
        'schema.find_problems',
        'physics.Design',
    }
    assert 'readers.bad_cells.forecast_bad_cells' in imported(
        ROOT / 'readers' / 'waveform_reader.py'
    )  # a late one
