# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What comes from outside is what is declared, or is refused: every declaration, spoiled."""

import dataclasses
import importlib
import json
import math
import pkgutil
from collections.abc import Mapping, Sequence
from enum import EnumMeta
from functools import cache
from types import UnionType
from typing import Any, Union, get_args, get_origin

import hypothesis
import hypothesis.strategies as st
import numpy as np
import pytest
from numpy.typing import NDArray
from suite import expect_rejection, replace_value

from mlmem import (
    Calibration,
    DelayTable,
    Faults,
    FollowTrajectory,
    MemoryElement,
    Settings,
    element_file,
    parsing,
)
from mlmem import snapshot as snapshots
from mlmem.commands import COMMANDS_BY_NAME
from mlmem.instrument.end import End
from mlmem.instrument.motion import Profile, Ramp
from mlmem.parsing import DecodeError, decode_value, encode_value
from mlmem.physics import CASE_II, Design, Specimen
from mlmem.physics.curve import Curve
from mlmem.readers.reading import Reading
from mlmem.schema import MAX_MESSAGE_CHARS, find_descriptions
from mlmem_ros.bag import jazzy
from mlmem_ros.contract import answers
from mlmem_ros.session import records

RECEIVED = Ramp, Profile, *answers.ANSWER_TYPES.values(), answers.Paused, answers.Recorded
"""Classes without a described field that come from outside too."""
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
def recorded():
    """Return plain values, by class, that only an element or a file can have."""
    table = DelayTable(
        tuple(float(level) for level in range(CASE_II.levels)),
        shapes=((0.5, None, 1.5),) * CASE_II.levels,
    )
    element = MemoryElement(CASE_II, Settings(), Calibration(table, table))
    element.reading = Reading(3, '011', 'left', 1.5, 0.9, 2.0, math.inf, walls=1)

    def decode_string(cdr):
        return json.loads(jazzy.deserialize_message(cdr, 'std_msgs/msg/String').data)

    return {
        records.Header: decode_string(records.build_header(element, '/mlmem', {})),
        records.StateHash: decode_string(records.build_state_hash(element)),
        snapshots.Snapshot: snapshots.take_snapshot(element),
        Calibration: encode_value(element.calibration),
        element_file._File: element_file.Element(Specimen(CASE_II), np.ones(CASE_II.N)).as_dict(),
        Design: encode_value(CASE_II),
        Specimen: encode_value(Specimen(CASE_II, mass=np.linspace(1.0, 2.0, CASE_II.N))),
        Curve: {'low': 0.0, 'high': 1.0, 'force': [0.0] * 8},
        Faults: encode_value(Faults(seed=3)),
        FollowTrajectory: {'times': [0.0, 1.0], 'strains': [0.0, 0.1], 'rates': []},
    }


def make_example(kind, given=parsing.ANY_VALUE):
    """Return plain values of a type; of a dataclass with every field, optional ones too."""
    if kind in recorded():
        return recorded()[kind]
    args = get_args(kind)
    if get_origin(kind) in (Union, UnionType):
        return make_example(args[0], given)
    if dataclasses.is_dataclass(kind):
        defaults = {each.name: each.default for each in dataclasses.fields(kind)}
        return {
            name: make_example(hint, description)
            if defaults[name] in (None, dataclasses.MISSING)
            else encode_value(defaults[name])
            for name, (hint, description, _) in parsing._describe_fields(kind).items()
        }
    if get_origin(kind) in (tuple, list, Sequence):
        return [make_example(args[0], given)] * (1 if args[-1] is ... else len(args))
    if get_origin(kind) in (dict, Mapping):
        return {make_example(args[0]): make_example(args[1], given)}
    if isinstance(kind, EnumMeta):
        return next(iter(kind)).value
    if get_origin(kind) is np.ndarray:
        return [1.0]
    return {bool: True, int: 1, float: 0.5, str: (*given.choices, '1')[0], Any: {}}[kind]


@cache
def examples():
    """Return plain values of every declaration, by class."""
    kinds = *described_classes(), *COMMANDS_BY_NAME.values(), *recorded(), *RECEIVED
    return {kind: json.loads(json.dumps(make_example(kind))) for kind in kinds}


def places(values, path=()):
    """Yield the path of every value, but of None."""
    if values is not None:
        yield path
    if isinstance(values, (dict, list)) and (not path or path[-1] not in OPEN):
        inner = values.items() if isinstance(values, dict) else enumerate(values)
        for key, each in list(inner)[:20]:
            yield from places(each, (*path, key))


def at(values, path):
    for key in path:
        values = values[key]
    return values


LONG = 'x' * 10**6
ANYTHING = st.sampled_from([LONG, [[[LONG]]], {7: LONG}])
NUMBERS = st.sampled_from([math.nan, math.inf, -math.inf, 10**400, 10**5000, '7', True, [1], {}])


@hypothesis.settings(max_examples=400, deadline=None)
@hypothesis.given(st.deferred(lambda: st.sampled_from(list(examples()))), st.data())
def test_spoiled_value_is_refused_in_one_short_message(kind, data):
    """Whatever is spoiled, and by whatever: one type of error, one line; other ones every time."""
    values = examples()[kind]
    path = data.draw(st.sampled_from(list(places(values))))
    good = at(values, path)
    number = isinstance(good, (int, float)) and not isinstance(good, bool)
    texts = st.sampled_from([7, [LONG]])
    worse = data.draw(NUMBERS if number else texts if isinstance(good, str) else ANYTHING)
    if path[:1] in {('packages',), ('actuator',), ('linkage',)} or 'shape' in path:
        return  # `restore` reads these further
    if worse == 7 and path[:1] == ('v',):
        return  # a number is as good as a hexadecimal one
    with pytest.raises(DecodeError) as caught:
        decode_value(kind, replace_value(values, path, worse))
    assert len(str(caught.value)) <= MAX_MESSAGE_CHARS
    assert '\n' not in str(caught.value)


def test_what_is_declared_is_read():
    for kind, values in examples().items():
        assert isinstance(decode_value(kind, values), kind)
        needed = [f.name for f in dataclasses.fields(kind) if f.default is dataclasses.MISSING
                  and f.default_factory is dataclasses.MISSING]  # fmt: skip
        for name in needed:
            with expect_rejection(DecodeError, 'missing_field', name):
                decode_value(kind, {k: v for k, v in values.items() if k != name})
        with expect_rejection(DecodeError, 'unknown_field', 'colour'):
            decode_value(kind, {**values, 'colour': 'red'})


def test_arrays_are_read_to_the_bit_in_every_form():
    values = np.array([1 / 3, -0.1, 5e-324])
    kind = NDArray[np.float64]
    for given in (values.tolist(), parsing.encode_array(values), [each.hex() for each in values]):
        np.testing.assert_array_equal(decode_value(kind, given), values)
    assert decode_value(dict[End, int], {'left': 1}) == {End.LEFT: 1}
