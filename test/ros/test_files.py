# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""With `files.root` the node writes only below one folder, whatever is requested."""

import pytest
from robot import Robot

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
    ('path', 'meant'),
    [
        ('session', 'session'),
        ('new/session', 'new/session'),
        ('below/../session', 'session'),
        ('{root}/below/session', 'below/session'),
        ('way_in/session', 'below/session'),
    ],
)
def test_path_below_the_root_is_accepted(root, path, meant):
    assert FileSettings(str(root)).confine_path(path.format(root=root)) == root.resolve() / meant


@pytest.mark.parametrize(
    'path',
    ['..', '.', '', '../session', '{root}', '/session', '~/x', 'way_out/x', 'below/../../x'],
)
def test_path_outside_the_root_is_rejected(root, path):
    with pytest.raises(SettingsError, match=r'must lie below files\.root = .*; it leads to /'):
        FileSettings(str(root)).confine_path(path.format(root=root))


def test_node_writes_only_below_its_root(start, root, tmp_path):
    node = start({'files.root': str(root), 'state.path': 'element.json'})
    with Robot() as robot:
        begun = robot.record(True)  # without a path: named session
        assert begun['path'].startswith(str(root / 'session'))
        assert robot.record(False).success
        for name, value in (('record.path', str(tmp_path / 'x')), ('files.root', '')):
            refused = robot.try_set(name, value)
            assert not refused.successful
            assert 'files.root' in refused.reason
        robot.set(record__path='later')
        (root / 'later').symlink_to(tmp_path / 'x')  # after the path was accepted
        refused = robot.record(True)
        assert not refused.success
        assert str(tmp_path / 'x') in refused['error']
        node.terminate()
        assert node.exit_status() == 0
    assert (root / 'element.json').is_file()
    assert not (tmp_path / 'x').exists()


@pytest.mark.parametrize('name', ['record.path', 'state.path'])
def test_node_with_a_path_outside_its_root_does_not_start(refused, root, tmp_path, name):
    line = refused({'files.root': str(root), name: str(tmp_path / 'x')})
    for word in ('files.root', str(root), str(tmp_path / 'x')):
        assert word in line


def test_node_with_root_rejects_another_address(start, root):
    """Or a client would have an unconfigured node write into any terminal, or connect anywhere."""
    address = 'tcp://127.0.0.1:1'
    start({'autostart': False, 'files.root': str(root), 'device.address': address})
    with Robot() as robot:
        for other in ('serial:///dev/pts/0', 'tcp://127.0.0.1:22'):
            refused = robot.try_set('device.address', other)
            assert not refused.successful
            assert 'with files.root it may be named only at the start' in refused.reason
        robot.set(device__address='')
        robot.set(device__address=address)


FOREIGN_FILES = (
    'root:x:0:0:root:/root:/bin/bash\n',
    '-----BEGIN hunter2-----\n',
    'hunter2: *hunter2\n',
    'hunter2: !hunter2 x\n',
    'hunter2: swordfish\n',
    '- hunter2\n',
    '"hunter2\n',
)


@pytest.mark.parametrize('name', ['element', 'twin'])
@pytest.mark.parametrize('text', FOREIGN_FILES)
def test_error_about_a_foreign_file_quotes_nothing_of_it(refused, root, name, text):
    (root / 'foreign').write_text(text)
    line = refused({'files.root': str(root), name: 'foreign'})
    assert 'foreign: ' in line
    assert not any(word in line for word in ('hunter2', 'swordfish', 'root:x', '/bin/bash'))


def test_unknown_parameter_at_the_start_is_reported(start):
    parameters = {'write.atempts': 5, 'probe.colour': 'red'}
    node = start(parameters)
    with Robot() as robot:
        robot.next('wall')
    told = [line for line in node.output.splitlines() if 'there is no parameter' in line]
    assert told == [
        '[WARN] [mlmem]: there is no parameter probe.colour: it is ignored',
        '[WARN] [mlmem]: there is no parameter write.atempts: it is ignored; '
        'did you mean write.attempts?',
    ]
