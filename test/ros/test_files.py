# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""With `files.root` the node writes only below one folder, whatever is requested."""

import pytest
from nodes import end_node

from mlmem import SettingsError
from mlmem_ros.host.settings import FileSettings


@pytest.fixture
def root(tmp_path):
    root = tmp_path / 'root'
    (root / 'below').mkdir(parents=True)
    (root / 'way_out').symlink_to(tmp_path)
    (root / 'way_in').symlink_to(root / 'below')
    return root


@pytest.mark.parametrize(
    ('path', 'below'),
    [
        ('session', 'session'),
        ('new/session', 'new/session'),
        ('below/../session', 'session'),
        ('{root}/below/session', 'below/session'),
        ('way_in/session', 'below/session'),
        *[(path, None) for path in ('..', '.', '', '../session', '{root}', '/session', '~/x')],
        ('way_out/x', None),
        ('below/../../x', None),
    ],
)
def test_path_is_accepted_if_it_is_below_the_root(root, path, below):
    settings, path = FileSettings(str(root)), path.format(root=root)
    if below is None:
        with pytest.raises(SettingsError, match=r'files\.root'):
            settings.confine_path(path)
    else:
        assert settings.confine_path(path) == root.resolve() / below


@pytest.mark.parametrize('path', ['~nosuchuser/x', 'a\0b', 'x' * 300, '/', '..'])
def test_path_that_cannot_be_a_file_is_rejected(path):
    with pytest.raises(SettingsError, match=r'must be (a writable path|the path of a file)'):
        FileSettings().confine_path(path)


def test_node_writes_only_below_its_root(start_robot, root, tmp_path):
    robot = start_robot({'files.root': str(root), 'state.path': 'element.json'})
    begun = robot.trigger('record', data=True)  # without a path: named session
    assert begun['path'].startswith(str(root / 'session'))
    assert robot.trigger('record', data=False).success
    for name, value in (('record.path', str(tmp_path / 'x')), ('files.root', '')):
        refused = robot.try_set(name, value)
        assert not refused.successful
        assert 'files.root' in refused.reason
    robot.set(record__path='later')
    (root / 'later').symlink_to(tmp_path / 'x')  # after the path was accepted
    refused = robot.trigger('record', data=True)
    assert not refused.success
    assert str(tmp_path / 'x') in refused['error']
    end_node(robot.memory)
    assert (root / 'element.json').is_file()
    assert not (tmp_path / 'x').exists()


@pytest.mark.parametrize('name', ['record.path', 'state.path'])
def test_node_with_a_path_outside_its_root_does_not_start(refused, root, tmp_path, name):
    line = refused({'files.root': str(root), name: str(tmp_path / 'x')})
    for word in ('files.root', str(root), str(tmp_path / 'x')):
        assert word in line


def test_node_with_root_rejects_another_address(start_robot, root):
    """Or a client would have an unconfigured node write into any terminal, or connect anywhere."""
    address = 'tcp://127.0.0.1:1'
    robot = start_robot({'autostart': False, 'files.root': str(root), 'device.address': address})
    for other in ('serial:///dev/pts/0', 'tcp://127.0.0.1:22'):
        assert 'files.root' in robot.try_set('device.address', other).reason
    robot.set(device__address='')
    robot.set(device__address=address)


@pytest.mark.parametrize(
    ('name', 'text'),
    [
        ('element', 'root:x:0:0:root:/root:/bin/bash\n'),
        ('element', '-----BEGIN hunter2-----\n'),
        ('element', 'hunter2: *hunter2\n'),
        ('element', 'hunter2: !hunter2 x\n'),
        ('element', 'hunter2: swordfish\n'),
        ('element', '- hunter2\n'),
        ('element', '"hunter2\n'),
        ('twin', '"hunter2\n'),
    ],
)
def test_error_about_a_foreign_file_quotes_nothing_of_it(refused, root, name, text):
    (root / 'foreign').write_text(text)
    line = refused({'files.root': str(root), name: 'foreign'})
    assert 'foreign: ' in line
    assert not any(word in line for word in ('hunter2', 'swordfish', 'root:x', '/bin/bash'))


def test_unknown_parameter_at_the_start_is_reported(start_robot):
    robot = start_robot({'write.atempts': 5, 'probe.colour': 'red'})
    robot.next('wall')
    lines = [line for line in robot.memory.output.splitlines() if 'there is no parameter' in line]
    assert [line.startswith('[WARN]') for line in lines] == [True, True]
    assert 'probe.colour' in lines[0]
    assert 'did you mean write.attempts?' in lines[1]
