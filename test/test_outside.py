# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What comes from outside is what is declared, or is refused: every declaration, spoiled."""

import dataclasses
import importlib
import json
import math
import pkgutil
from functools import cache

import hypothesis
import hypothesis.strategies as st
import numpy as np
import pytest
from numpy.typing import NDArray

from mlmem import (
    Calibration,
    DelayTable,
    FollowTrajectory,
    MemoryElement,
    Settings,
    element_file,
    law_file,
    parsing,
)
from mlmem import snapshot as snapshots
from mlmem.commands import COMMANDS_BY_NAME
from mlmem.element_file import Element
from mlmem.instrument.end import End
from mlmem.instrument.motion import Profile, Ramp
from mlmem.parsing import (
    MAX_MESSAGE_CHARS,
    DecodeError,
    decode_value,
    encode_value,
)
from mlmem.physics import CASE_II, Specimen
from mlmem.readers.calibration import PulseCorrection, PulseCorrections
from mlmem.readers.reading import Reading
from mlmem.schema import find_descriptions
from mlmem_ros.bag import jazzy
from mlmem_ros.contract import answers
from mlmem_ros.rig.frames import Hello
from mlmem_ros.session import records

OPEN = ('initial', 'parameters', 'packages', 'details')
"""Keys whose values are read by others, later or never."""


def described_classes():
    """Yield every dataclass of our packages with a described field."""
    packages = ('contract', 'host', 'rig', 'session')
    for package in ('mlmem', *(f'mlmem_ros.{name}' for name in packages)):
        found = importlib.import_module(package)
        for each in pkgutil.walk_packages(found.__path__, f'{found.__name__}.'):
            for kind in vars(importlib.import_module(each.name)).values():
                ours = isinstance(kind, type) and kind.__module__ == each.name
                if ours and dataclasses.is_dataclass(kind) and any(find_descriptions(kind)):
                    yield kind


@cache
def examples():
    """Return plain values of every declaration, by class."""
    table = DelayTable(
        tuple(float(level) for level in range(CASE_II.levels)),
        shapes=((0.5, None, 1.5),) * CASE_II.levels,
    )
    corrections = PulseCorrections(
        (PulseCorrection(),) * CASE_II.levels,
        'hash',
        (1.0,) * CASE_II.levels,
    )
    element = MemoryElement(CASE_II, Settings(), Calibration(table, table, corrections))
    element.reading = Reading(3, '011', 'left', 1.5, 0.9, 2.0, math.inf, walls=1)

    def decode_string(cdr):
        return json.loads(jazzy.deserialize_message(cdr, 'std_msgs/msg/String').data)

    header = records.build_header(element, '/mlmem', {'record.hash_every': 500})
    hashed = records.build_state_hash(element)
    told = dict.fromkeys(('attempts', 'ticks', 'tick', 'level', 'word'), 1)
    told |= dict.fromkeys(('delay', 'right_delay', 'level_margin', 'threshold_margin'), 0.5)
    told |= dict.fromkeys(('passed', 'paused', 'recording'), True)
    told |= {
        'code': '1', 'end': 'left', 'checks': {'erase': 'blank'}, 'failed': ['levels'],
        'delays': {'left': [1.0]}, 'path': 'bag', 'details': {}, 'walls': 1, 'reason': 'why',
        'position': 9.5, 'position_std': 0.1, 'cells': '4 9', 'kinds': 'wall', 'stuck_cell': 7,
        'shots': 3, 'half': 'tension', 'confidence': 0.5, 'kick_factor': 0.9, 'loss_factor': 1.1,
    }  # fmt: skip
    found = {
        records.Header: decode_string(header),
        records.StateHash: decode_string(hashed),
        snapshots.Snapshot: snapshots.take_snapshot(element),
        Calibration: encode_value(element.calibration),
        Specimen: encode_value(Specimen(CASE_II, mass=np.linspace(1.0, 2.0, CASE_II.N))),
        Ramp: dataclasses.asdict(Ramp(0.0, 0.1, 5.0)),
        Profile: dataclasses.asdict(Profile((0.0, 1.0), (0.0, 0.1))),
        Hello: dataclasses.asdict(Hello(1, 'rig', 0.25, 80, 1e-5, 1e-2, 1000)),
        element_file._File: Element(Specimen(CASE_II), np.ones(CASE_II.N)).as_dict(),
        law_file._File: {'law': {'low': 0.0, 'high': 1.0, 'force': [0.0] * 8}, 'format': 1},
    }
    procedures = (answers.Decoded, *answers.ANSWER_TYPES.values())
    for kind in (*procedures, answers.Paused, answers.Recorded):
        found[kind] = {each.name: told[each.name] for each in dataclasses.fields(kind)}
    values = {
        'level': 1,
        'strain': 0.1,
        'acceleration': 0.1,
        'faults': {'seed': 3},
        'method': 'strain',
    }
    for kind in COMMANDS_BY_NAME.values():
        found[kind] = {
            f.name: 1 if (given := values.get(f.name, f.default)) is dataclasses.MISSING else given
            for f in dataclasses.fields(kind)
        }
    found[FollowTrajectory] = {'times': [0.0, 1.0], 'strains': [0.0, 0.1], 'rates': []}
    for kind in described_classes():
        if kind not in found and all(f.default is not dataclasses.MISSING for f in fields(kind)):
            found[kind] = dataclasses.asdict(kind())
    return {kind: json.loads(json.dumps(each)) for kind, each in found.items()}


def fields(kind):
    return [f for f in dataclasses.fields(kind) if f.default_factory is dataclasses.MISSING]


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


@cache
def places_of(kind):
    values = examples()[kind]
    return [each for each in places(values) if at(values, each) is not None]


LONG = 'x' * 10**6
ANYTHING = st.sampled_from([LONG, [[[LONG]]], {7: LONG}])
NUMBERS = st.sampled_from([math.nan, math.inf, -math.inf, 10**400, '7', True, [1], {}])


@hypothesis.settings(max_examples=400, deadline=None)
@hypothesis.given(st.deferred(lambda: st.sampled_from(list(examples()))), st.data())
def test_spoiled_value_is_refused_in_one_short_message(kind, data):
    """Whatever is spoiled, and by whatever: one type of error, one line; other ones every time."""
    values = examples()[kind]
    path = data.draw(st.sampled_from(places_of(kind)))
    number = isinstance(at(values, path), (int, float)) and not isinstance(at(values, path), bool)
    text = isinstance(at(values, path), str)
    worse = data.draw(NUMBERS if number else st.sampled_from([7, [LONG]]) if text else ANYTHING)
    if path[:1] in {('packages',), ('actuator',), ('linkage',)} or 'shape' in path:
        return  # `restore` reads these further
    if worse == 7 and path[:1] == ('v',):
        return  # a number is as good as a hexadecimal one
    with pytest.raises(DecodeError) as caught:
        decode_value(kind, spoiled(values, path, worse))
    assert len(str(caught.value)) <= MAX_MESSAGE_CHARS
    assert '\n' not in str(caught.value)


def test_what_is_declared_is_read():
    for kind, values in examples().items():
        assert isinstance(decode_value(kind, values), kind)
        needed = [f.name for f in dataclasses.fields(kind) if f.default is dataclasses.MISSING
                  and f.default_factory is dataclasses.MISSING]  # fmt: skip
        for name in needed:
            with pytest.raises(DecodeError, match=f'lacks {name}'):
                decode_value(kind, {k: v for k, v in values.items() if k != name})
        with pytest.raises(DecodeError, match=r"there is no 'colour'; there are|lacks"):
            decode_value(kind, {**values, 'colour': 'red'})


def test_every_described_class_is_among_them():
    reached = set()

    def reach(kind):
        if dataclasses.is_dataclass(kind) and kind not in reached:
            reached.add(kind)
            for hint, *_ in parsing._describe_fields(kind).values():
                reach(hint)
        for inner in getattr(kind, '__args__', ()):
            reach(inner)

    for kind in examples():
        reach(kind)
    assert set(described_classes()) - reached == set()


def test_arrays_are_read_to_the_bit_in_every_form():
    values = np.array([1 / 3, -0.1, 5e-324])
    kind = NDArray[np.float64]
    for given in (values.tolist(), parsing.encode_array(values), [each.hex() for each in values]):
        np.testing.assert_array_equal(decode_value(kind, given), values)
    assert decode_value(dict[End, int], {'left': 1}) == {End.LEFT: 1}
