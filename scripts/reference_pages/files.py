# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Formats of files, whose keys are compared with those that are written."""

import dataclasses
import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mlmem import MemoryElement, Read, element_file, load_element, snapshot
from mlmem.moves import corrections
from mlmem.physics import Specimen
from mlmem_ros.bag import jazzy
from mlmem_ros.host import store
from mlmem_ros.session import records

from . import keys
from .table import listing


def generate_files() -> dict[str, str]:
    """Return the keys of all formats, whose keys are compared with those of an element's files."""
    element = MemoryElement(load_element('bits_1'))
    taken = snapshot.take_snapshot(element)
    plan = corrections.PulseCorrections((corrections.PulseCorrection(),) * 2, '', (1.0,) * 2)
    made = Specimen(element.design, k_r_factor=1.01, offset=0.01)
    known = element_file.Element(
        dataclasses.replace(made, mass=2.0, stuck=(9,)), made.alpha, 1.01,
        {'left': (0.0, 1.0)}, data=1, plan=plan,
    )  # fmt: skip
    element.made, element.forecast, element.twin = made, element.calibration, made
    header = _content(records.build_header(element, '/mlmem', {}))
    hashed = _content(records.build_state_hash(element))
    command = _content(records.build_command(0, Read()))
    arguments = ['...'] if command.keys() - {'tick', 'kind'} else []

    session = keys.SESSION
    return {
        'session topics': listing((f'`~/{name}`', text) for name, text in keys.TOPICS.items()),
        'session': _keys(session[records.HEADER_TOPIC], header),
        'command': _keys(session[records.COMMAND_TOPIC], ['tick', 'kind', *arguments]),
        'state hash': _keys(session[records.STATE_HASH_TOPIC], hashed),
        'state': _keys(keys.STATE, _written(store.save_snapshot, taken)),
        'element': _keys(keys.ELEMENT, known.as_dict()),
    }


def _keys(meanings: Mapping[str, str], found: Iterable[str]) -> str:
    """Return a list of keys; raise `ValueError` unless they are those in a file."""
    if wrong := set(meanings) ^ set(found):
        raise ValueError(f'keys and their descriptions must agree; got {sorted(wrong)}')
    return listing((f'`{key}`', text) for key, text in meanings.items())


def _written(save: Callable[..., None], *content: Any) -> Any:
    """Return what is in a file that was saved."""
    with TemporaryDirectory() as folder:
        path = Path(folder, 'file.json')
        save(path, *content)
        return json.loads(path.read_text(encoding='utf-8'))


def _content(cdr: bytes) -> Any:
    return json.loads(jazzy.deserialize_message(cdr, records.STRING_TYPE).data)
