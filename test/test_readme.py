# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The README tells what the code declares."""

from pathlib import Path

from mlmem_ros.contract import topics

ROOT = Path(__file__).parent.parent
README = (ROOT / 'README.md').read_text(encoding='utf-8')


def test_every_topic_and_service_is_told():
    for topic in topics.COMMANDS + topics.STREAMS + topics.VIEWS:
        assert f'`~/{topic.name}`' in README, topic
    for name in ('request', 'write', 'read', 'erase', 'calibrate', 'abort', 'pause', 'step'):
        assert f'`~/{name}`' in README, name


def test_every_subcommand_is_told():
    from mlmem_ros.cli.main import SUBCOMMANDS

    for name in SUBCOMMANDS:
        assert f'`mlmem {name}' in README, name


def test_the_pictures_are_there():
    import re

    for path in re.findall(r'!\[[^\]]*\]\(([^)]+)\)', README):
        assert (ROOT / path).is_file(), path
