# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page on files lists the keys of every format, and its version."""

import dataclasses
import re
from pathlib import Path

from mlmem import Settings, element_file
from mlmem.schema import find_descriptions
from mlmem_ros.session import records

PAGE = Path(__file__).parents[2] / 'docs' / 'reference' / 'files.md'
SECTIONS = {
    '### `~/session`': records.Header,
    '### `~/session/state_hash`': records.StateHash,
    '## Element': element_file._File,
}
"""The declaration of what is read, and so of what is written, by heading."""


def test_page_lists_the_keys_and_versions_that_are_declared():
    text, groups = PAGE.read_text(encoding='utf-8'), Settings().list_groups()
    for heading, kind in SECTIONS.items():
        section = text.partition(f'{heading}\n')[2].partition('\n#')[0]
        listed = dict(re.findall(r'^- `(\w+)`: (.+)', section, re.MULTILINE))
        declared = {field.name for field in dataclasses.fields(kind)} - groups.keys()
        assert listed.keys() == declared, heading
        for field, description in find_descriptions(kind):
            if field.name == 'format':
                assert listed['format'].endswith(f' {description.high}'), heading


def test_page_lists_the_topics_of_a_session():
    text = PAGE.read_text(encoding='utf-8')
    assert all(f'- `~/{topic}`: ' in text for topic in records.SessionTopic)
