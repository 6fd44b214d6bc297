# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which bags hold a session that can be replayed."""

from pathlib import Path

import pytest

from mlmem_ros.bag.errors import BagError
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay
from mlmem_tools.cli.main import main

from .tampering import Tampered

DATA = Path(__file__).parent.parent / 'data'


def renamed(session, node):
    """Return a copy of a session of /mlmem as one of another node."""

    def rename(topic):
        return node + topic.removeprefix('/mlmem')

    return Tampered(
        {
            rename(name): type(info)(rename(name), info.type)
            for name, info in session.topics.items()
        },
        [each._replace(topic=rename(each.topic)) for each in session.messages],
    )


def test_session_that_takes_too_much_memory_is_rejected():
    with pytest.raises(BagError) as caught:
        load_session(DATA / 'life', max_bytes=10_000)
    assert caught.value.code == 'too_large'


def test_session_with_a_clock_set_back_is_exact(tmp_path):
    """As NTP steps a clock, half an hour back in the middle of a session."""
    whole = Tampered.read(DATA / 'life')
    middle = len(whole.messages) // 2
    whole.messages[middle:] = [
        message._replace(log_time=message.log_time - 1800 * 10**9)
        for message in whole.messages[middle:]
    ]
    whole.write(tmp_path / 'stepped')
    session = load_session(tmp_path / 'stepped')
    assert run_replay(session).exact
    times = [time for time, _ in session.outcomes]
    assert times == sorted(times)
    assert times[-1] < 60.0
    whole.messages.sort(key=lambda message: message.log_time)
    whole.write(tmp_path / 'sorted')
    with pytest.raises(BagError, match='a copy sorted by time cannot be replayed'):
        run_replay(load_session(tmp_path / 'sorted'))


def test_bag_without_a_session_is_rejected(tmp_path):
    made = renamed(Tampered.read(DATA / 'life'), '/talker')
    made.messages = [each for each in made.messages if each.topic == '/talker/level']
    made.topics = {'/talker/level': made.topics['/talker/level']}
    made.write(tmp_path / 'bag')
    with pytest.raises(BagError, match=r'must hold a session .*/talker/level'):
        load_session(tmp_path / 'bag')


def test_bag_of_several_nodes_needs_a_name(tmp_path):
    life = Tampered.read(DATA / 'life')
    both, other = renamed(life, '/a'), renamed(life, '/b')
    both.topics |= other.topics
    both.messages += other.messages
    both.write(tmp_path / 'bag')
    with pytest.raises(BagError, match="'/a', '/b'"):
        load_session(tmp_path / 'bag')
    assert run_replay(load_session(tmp_path / 'bag', '/b')).passed


def test_texts_from_a_bag_are_not_markup(tmp_path, capsys):
    """Names that rich would read as styles or an emoji, or that clear the terminal."""
    renamed(Tampered.read(DATA / 'life'), '/[/red]:smile:\x1b[2J').write(tmp_path / 'bag')
    assert main(['inspect', str(tmp_path / 'bag')]) == 0
    told = capsys.readouterr().out
    assert '/[/red]:smile:\\x1b[2J' in told
    assert '\x1b' not in told
