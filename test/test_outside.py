# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What comes from outside is what is declared, or is refused: every declaration, spoiled."""

import dataclasses
import importlib
import json
import math
import os
import pkgutil
import signal
import time
import tracemalloc
from pathlib import Path

import hypothesis
import hypothesis.strategies as st
import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from mlmem_ros import element_file, outside
from mlmem_ros.bag import jazzy
from mlmem_ros.contract import answers
from mlmem_ros.described import descriptions
from mlmem_ros.device import Calibration, DelayTable, FollowTrajectory, MemoryElement, Settings
from mlmem_ros.device import snapshot as snapshots
from mlmem_ros.device.commands import KINDS
from mlmem_ros.device.end import End
from mlmem_ros.device.failures import Failure
from mlmem_ros.device.motion import Profile, Ramp
from mlmem_ros.device.pulse_corrections import AS_SET, PulseCorrections, QuickMoves
from mlmem_ros.device.reading import Reading
from mlmem_ros.element_file import Element, ElementFileError
from mlmem_ros.outside import LONGEST, DecodeError, decode, from_json, from_yaml, read
from mlmem_ros.parameter_file import ParameterFileError
from mlmem_ros.parameter_file import load as load_parameters
from mlmem_ros.physics import CASE_II, Specimen
from mlmem_ros.rig.frames import Hello
from mlmem_ros.session import records
from mlmem_tools.cli.main import main

OPEN = ('initial', 'parameters', 'packages', 'details')
"""Keys whose values are read by others, later or never."""


def described_classes():
    """Yield every dataclass of the package with a described field."""
    packages = ('contract', 'device', 'host', 'physics', 'rig', 'session')
    for package in packages:
        found = importlib.import_module(f'mlmem_ros.{package}')
        for each in pkgutil.iter_modules(found.__path__, f'{found.__name__}.'):
            for kind in vars(importlib.import_module(each.name)).values():
                ours = isinstance(kind, type) and kind.__module__ == each.name
                if ours and dataclasses.is_dataclass(kind) and any(descriptions(kind)):
                    yield kind


def examples():
    """Return plain values of every declaration, by class."""
    table = DelayTable(
        tuple(float(level) for level in range(CASE_II.levels)),
        shapes=((0.5, None, 1.5),) * CASE_II.levels,
    )
    trims = PulseCorrections(
        (AS_SET,) * CASE_II.levels, 'hash', QuickMoves({'throw': {1: 0.5}}, 'hash')
    )
    element = MemoryElement(CASE_II, Settings(), Calibration(table, table, trims))
    element.reading = Reading(3, '011', 'left', 1.5, 0.9, 2.0, math.inf, walls=1)
    header = records.header(element, '/mlmem', {'record.hash_every': 500})
    hashed = records.state_hash(element)
    told = dict.fromkeys(('attempts', 'ticks', 'tick', 'level'), 1)
    told |= dict.fromkeys(('delay', 'level_margin', 'threshold_margin', 'confidence'), 0.5)
    told |= {
        'word': '0x1',
        'code': '1',
        'end': 'left',
        'passed': True,
        'checks': {'erase': 'blank'},
    }
    told |= {'failed': ['levels'], 'delays': {'left': [1.0]}, 'paused': True, 'recording': True}
    told |= {'path': 'bag', 'details': {}, 'right_delay': 0.5, 'walls': 1, 'reason': 'why'}
    told |= {
        'position': 9.5,
        'position_std': 0.1,
        'cells': '4 9',
        'kinds': 'wall',
        'shots': 3,
        'half': 'tension',
    }
    found = {
        records.Header: json.loads(jazzy.deserialize(header, records.STRING).data),
        records.StateHash: json.loads(jazzy.deserialize(hashed, records.STRING).data),
        snapshots.Saved: snapshots.take(element),
        Calibration: element.calibration.as_dict(),
        Specimen: Specimen(CASE_II, mass=np.linspace(1.0, 2.0, CASE_II.N)).as_dict(),
        Ramp: dataclasses.asdict(Ramp(0.0, 0.1, 5.0)),
        Profile: dataclasses.asdict(Profile((0.0, 1.0), (0.0, 0.1))),
        Hello: dataclasses.asdict(Hello(1, 'rig', 0.25, 80, 1e-5, 1e-2, 1000)),
        element_file._File: Element(Specimen(CASE_II), np.ones(CASE_II.N)).as_dict(),
    }
    procedures = (answers.Decoded, *answers.ANSWERS.values())
    for kind in (*procedures, answers.Paused, answers.Recorded, answers.Stepped):
        found[kind] = {each.name: told[each.name] for each in dataclasses.fields(kind)}
    values = {
        'level': 1,
        'strain': 0.1,
        'acceleration': 0.1,
        'faults': {'seed': 3},
        'method': 'strain',
        'script': '[]',
    }
    for kind in KINDS.values():
        found[kind] = {
            f.name: 1 if (given := values.get(f.name, f.default)) is dataclasses.MISSING else given
            for f in dataclasses.fields(kind)
        }
    found[Failure] = {'unit': 'sensor', 'failure': 'off', 'tick': 0, 'instance': 1}
    found[FollowTrajectory] = {'times': [0.0, 1.0], 'strains': [0.0, 0.1], 'rates': []}
    for kind in described_classes():
        if kind not in found and all(f.default is not dataclasses.MISSING for f in fields(kind)):
            found[kind] = dataclasses.asdict(kind())
    return {kind: json.loads(json.dumps(each)) for kind, each in found.items()}


def fields(kind):
    return [f for f in dataclasses.fields(kind) if f.default_factory is dataclasses.MISSING]


EXAMPLES = examples()


def places(values, path=()):
    """Yield the path of every value."""
    yield path
    if isinstance(values, (dict, list)) and (not path or path[-1] not in OPEN):
        inner = values.items() if isinstance(values, dict) else enumerate(values)
        for key, each in list(inner)[:20]:
            yield from places(each, (*path, key))


def spoiled(values, path, worse):
    """Return values with one replaced."""
    if not path:
        return worse
    made = values.copy()
    made[path[0]] = spoiled(values[path[0]], path[1:], worse)
    return made


def at(values, path):
    for key in path:
        values = values[key]
    return values


LONG = 'x' * 10**6
ANYTHING = st.sampled_from([LONG, [[[LONG]]], {7: LONG}])
NUMBERS = st.sampled_from([math.nan, math.inf, -math.inf, 10**400, '7', True, [1], {}])


@hypothesis.settings(max_examples=1500, deadline=None)
@hypothesis.given(st.sampled_from(list(EXAMPLES)), st.data())
def test_a_spoiled_value_is_refused_in_one_short_message(kind, data):
    """Whatever is spoiled, and by whatever: one type of error, one line."""
    values = EXAMPLES[kind]
    found = [each for each in places(values) if at(values, each) is not None]
    path = data.draw(st.sampled_from(found))
    number = isinstance(at(values, path), (int, float)) and not isinstance(at(values, path), bool)
    text = isinstance(at(values, path), str)
    worse = data.draw(NUMBERS if number else st.sampled_from([7, [LONG]]) if text else ANYTHING)
    if path[:1] in {('packages',), ('actuator',), ('linkage',)} or 'shape' in path:
        return  # `restore` reads these further
    if worse == 7 and path[:1] == ('v',):
        return  # a number is as good as a hexadecimal one
    with pytest.raises(DecodeError) as caught:
        decode(kind, spoiled(values, path, worse))
    assert len(str(caught.value)) <= LONGEST
    assert '\n' not in str(caught.value)


@pytest.mark.parametrize('kind', EXAMPLES, ids=lambda kind: kind.__name__)
def test_what_is_declared_is_read(kind):
    made = decode(kind, EXAMPLES[kind])
    assert isinstance(made, kind)
    needed = [f.name for f in dataclasses.fields(kind) if f.default is dataclasses.MISSING
              and f.default_factory is dataclasses.MISSING]  # fmt: skip
    for name in needed:
        with pytest.raises(DecodeError, match=f'lacks {name}'):
            decode(kind, {k: v for k, v in EXAMPLES[kind].items() if k != name})
    with pytest.raises(DecodeError, match=r"there is no 'colour'; there are|lacks"):
        decode(kind, {**EXAMPLES[kind], 'colour': 'red'})


def test_every_described_class_is_among_them():
    reached = set()

    def reach(kind):
        if dataclasses.is_dataclass(kind) and kind not in reached:
            reached.add(kind)
            for hint, *_ in outside._declared(kind).values():
                reach(hint)
        for inner in getattr(kind, '__args__', ()):
            reach(inner)

    for kind in EXAMPLES:
        reach(kind)
    assert set(described_classes()) - reached == set()


def test_arrays_are_read_to_the_bit_in_every_form():
    values = np.array([1 / 3, -0.1, 5e-324])
    kind = NDArray[np.float64]
    for given in (values.tolist(), outside.encoded(values), [each.hex() for each in values]):
        np.testing.assert_array_equal(decode(kind, given), values)
    assert decode(dict[End, int], {'left': 1}) == {End.LEFT: 1}


# --- files ------------------------------------------------------------------------------------

LOADERS = {
    'element': (element_file.load, ElementFileError),
    'parameters': (lambda path: load_parameters(str(path)), ParameterFileError),
}


@pytest.fixture(params=LOADERS)
def refused(request):
    """Return a function that gives the error of a file, after a moment and with little memory."""
    load, error = LOADERS[request.param]

    def of(path):
        tracemalloc.start()
        start = time.process_time()
        try:
            with pytest.raises(error) as caught:
                load(path)
            assert tracemalloc.get_traced_memory()[1] < 150e6  # a file at its limit, parsed
            assert time.process_time() - start < 5.0  # seconds; a bomb took 25
        finally:
            tracemalloc.stop()
        assert len(str(caught.value)) <= LONGEST + 300  # and the path
        return str(caught.value)

    return of


def test_only_regular_files_are_read(refused, tmp_path):
    os.mkfifo(tmp_path / 'pipe')
    assert 'not a regular file' in refused(Path('/dev/zero'))
    assert 'not a regular file' in refused(tmp_path / 'pipe')
    assert 'Is a directory' in refused(tmp_path)
    assert 'null' in refused(tmp_path / 'a\0b')


BOMB = 'a0: &a0 [x]\n' + ''.join(
    f'a{n}: &a{n} [{", ".join([f"*a{n - 1}"] * 10)}]\n' for n in range(1, 9)
)


@pytest.mark.parametrize(
    'text',
    [BOMB, '[' * 10**5, '{a: ' * 10**5, 'a: .inf', f'a: {"9" * 5000}', '? [1]\n: 2',
     '!!python/x 1',
     'a: 2001-99-99', '\x00', f'{{format: 1, design: "{LONG}"}}', f'"{LONG}": 1',
     f'format: {LONG}', 'a: &a [*a]', '*x',
     'format: .nan', f'/**: {{ros__parameters: {{design: {{N: {"9" * 10**6}}}}}}}',
     f'/**: {{ros__parameters: {{{LONG}: 1}}}}'],
    ids=lambda text: text[:24],
)  # fmt: skip
def test_no_text_is_read_for_long_or_escapes(refused, tmp_path, text):
    path = tmp_path / 'file.yaml'
    path.write_text(text)
    refused(path)


def test_a_file_is_bounded(refused, tmp_path):
    path = tmp_path / 'file.yaml'
    with path.open('wb') as file:
        file.truncate(50 * 10**9)
    assert 'larger than 33554432 bytes' in refused(path)


@pytest.mark.parametrize(
    ('key', 'value', 'words'),
    [('alpha_std', math.nan, 'alpha_std must be'), ('alpha_std', -1e-3, 'from 0 to 1e'),
     ('alpha', 1e308, 'alpha must be from 1/100 to 100'), ('alpha', math.inf, 'alpha must be'),
     ('mass', 0.0, 'mass'), ('offset', 10**400, 'offset')],
)  # fmt: skip
def test_an_element_that_no_cell_can_be_is_refused(tmp_path, key, value, words):
    values = Element(Specimen(CASE_II), np.ones(CASE_II.N)).as_dict()
    numbers = list(values.get(key, [1.0] * CASE_II.N))
    numbers[5] = value
    path = tmp_path / 'element.yaml'
    path.write_text(yaml.safe_dump(values | {key: numbers}))
    with pytest.raises(ElementFileError, match=words):
        element_file.load(path)


def test_texts_that_are_not_what_they_should_be():
    assert from_json('{"a": 1}') == from_yaml('{a: 1}') == {'a': 1}
    assert from_yaml('a: 1', texts=True) == {'a': '1'}
    for text in ('', '[' * 10**6, 'NaN', '9' * 5000):
        with pytest.raises(DecodeError, match='it must be JSON'):
            from_json(text)
    with pytest.raises(DecodeError, match='No such file'):
        read('/nowhere/at all')


COMMANDS = (
    'inspect {}', 'inspect {} --repair {new}', 'replay {}', 'view {}', 'view --start {}',
    'design check {}', 'design check case_2 --element {}', 'fit {} --output {new}',
    'fit {}.csv --design case_2', 'fit {}.csv --design {}', 'plan {} --output {new}',
    'margins --design {} --output {new}', 'standard_problems {}',
)  # fmt: skip
"""Commands that read a file."""


@pytest.fixture
def at_once():
    """Fail after ten seconds of waiting, which a pipe without a writer would take for ever."""

    def interrupt(*_):
        pytest.fail('it waits')  # no error that a command would catch

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 10.0)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.parametrize('command', COMMANDS)
@pytest.mark.parametrize('kind', ['pipe', 'device', 'huge', 'NUL', 'folder', 'absent'])
def test_a_command_refuses_what_is_no_file_at_once(command, kind, tmp_path, capsys, at_once):
    for name in ('named', 'named.csv'):
        path = tmp_path / name
        if kind == 'pipe':
            os.mkfifo(path)
        elif kind == 'device':
            path.symlink_to('/dev/zero')
        elif kind == 'huge':
            with path.open('wb') as file:
                file.truncate(50 * 10**9)
        elif kind == 'folder':
            path.mkdir()
    given = str(tmp_path / ('na\0med' if kind == 'NUL' else 'named'))
    words = [word.format(given, new=tmp_path / 'new') for word in command.split()]
    try:
        status = main(words)
    except SystemExit as end:
        status = end.code
    told = capsys.readouterr().err
    assert status in (1, 2), told
    assert 'Traceback' not in told
    assert len(told) < 1000
    assert not (tmp_path / 'new').exists()
