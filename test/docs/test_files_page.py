# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page on files lists the keys of every format as they are written."""

import json
import re
from dataclasses import replace
from pathlib import Path

from mlmem import MemoryElement, Read, element_file, load_element, snapshot
from mlmem.physics import Specimen
from mlmem.readers.calibration import PulseCorrection, PulseCorrections
from mlmem_ros.bag import jazzy
from mlmem_ros.host import store
from mlmem_ros.session import records

PAGE = Path(__file__).parents[2] / 'docs' / 'reference' / 'files.md'


def decode(cdr):
    return json.loads(jazzy.deserialize_message(cdr, 'std_msgs/msg/String').data)


def write_every_format(folder):
    """Return what is written in every format, with all optional keys, by the page's heading."""
    element, state = MemoryElement(load_element('bits_1')), folder / 'state.json'
    store.save_snapshot(state, snapshot.take_snapshot(element))
    made = Specimen(element.design, k_r_factor=1.01, offset=0.01)
    plan = PulseCorrections((PulseCorrection(),) * 2, '', (1.0,) * 2)
    fitted = element_file.Element(
        replace(made, mass=2.0, stuck=(9,)), made.alpha, 1.01,
        element_file.TransducerValues(zero=(0.0, 1.0)), 1.0, 1, ('j_0',), plan=plan,
    )  # fmt: skip
    element.made, element.forecast, element.twin = made, element.calibration, made
    return {
        '### `~/session`': decode(records.build_header(element, '/mlmem', {})),
        '### `~/session/command`': decode(records.build_command(0, Read())),
        '### `~/session/state_hash`': decode(records.build_state_hash(element)),
        '## State': json.loads(state.read_text(encoding='utf-8')),
        '## Element': fitted.as_dict(),
    }


def test_page_lists_the_keys_that_are_written(tmp_path):
    text = PAGE.read_text(encoding='utf-8')
    for heading, content in write_every_format(tmp_path).items():
        section = text.partition(f'{heading}\n')[2].partition('\n#')[0]
        listed = re.findall(r'^- `(\w+)`: (.+)', section, re.MULTILINE)
        expected = content.keys() - {'end'}  # an argument of a command
        assert {key for key, _ in listed} == expected, heading
        assert dict(listed).get('format', '1').endswith(str(content.get('format', 1)))


def test_page_lists_the_topics_of_a_session():
    text = PAGE.read_text(encoding='utf-8')
    assert all(f'- `~/{topic}`: ' in text for topic in records.SessionTopic)
