# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Nothing read from a file or a message is executed: no pickle, no eval, safe YAML."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SOURCES = sorted(
    path for folder in ('mlmem_ros', 'mlmem_tools', 'lab/mlmem_lab', 'launch', 'examples', 'tools')
    for path in (ROOT / folder).rglob('*.py')
)  # fmt: skip

MODULES = {'pickle', 'cPickle', 'dill', 'cloudpickle', 'joblib', 'marshal', 'shelve'}
FUNCTIONS = {'eval', 'exec', 'os.system', 'os.popen'}
YAML = {f'yaml.{kind}load{all_}' for kind in ('', 'full_', 'unsafe_') for all_ in ('', '_all')}
WORDS = re.compile(
    '|'.join([*MODULES, 'eval', 'exec', 'system', 'popen', 'yaml', 'allow_p', 'shell'])
)
"""Without any of these a source has nothing to be found."""

SAFE = {'yaml.SafeLoader', 'yaml.BaseLoader', 'BaseLoader'}
ARGUMENTS = {'allow_pickle': True, 'shell': True}


def found(source):
    """Return the names in a source that would execute their input."""
    names = set()
    if not WORDS.search(source):
        return names
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name.split('.')[0] for alias in node.names} & MODULES
        elif isinstance(node, ast.ImportFrom):
            names |= {(node.module or '').split('.')[0]} & MODULES
        elif isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            names |= {called} & FUNCTIONS
            if called in YAML and not {ast.unparse(each) for each in node.args[1:]} & SAFE:
                names.add(called)
            names |= {
                f'{word.arg}={word.value.value}'
                for word in node.keywords
                if word.arg in ARGUMENTS and getattr(word.value, 'value', None) is True
            }
    return names


@pytest.mark.parametrize(
    'source',
    [
        'import pickle', 'from pickle import loads', 'import dill.source', 'eval("1")',
        'yaml.load(text)', 'yaml.load(text, yaml.Loader)', 'np.load(path, allow_pickle=True)',
        'subprocess.run(line, shell=True)',
    ],
)  # fmt: skip
def test_the_search_finds_each_pattern(source):
    assert found(source)


def test_no_input_is_executed():
    assert len(SOURCES) > 100
    assert {str(path): names for path in SOURCES if (names := found(path.read_text()))} == {}
