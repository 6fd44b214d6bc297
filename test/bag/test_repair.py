# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A repaired bag is whole, and the damaged one is unchanged."""

import pytest
from rosbags.highlevel import AnyReader

from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.mcap_part import McapPart
from mlmem_ros.bag.metadata import LOST
from mlmem_ros.bag.reader import BagReader
from mlmem_tools.repairing import repair


@pytest.fixture
def damaged(record):
    """A bag cut off in its sixteenth chunk, without metadata, as a killed recorder leaves it."""
    path = record(sync_each=True, custom_data={'seed': '42'})
    (path / 'metadata.yaml').unlink()
    file = path / 'bag_0.mcap'
    file.write_bytes(file.read_bytes()[: McapPart(file).blocks[15].offset + 10])
    return path


def test_what_can_be_read_is_saved(damaged, messages, tmp_path):
    report = repair(damaged, tmp_path / 'whole')
    assert report.messages == 15  # a chunk holds one
    assert report.losses == BagReader(damaged).losses
    whole = BagReader(tmp_path / 'whole')
    assert list(whole) == messages[:15]
    assert whole.losses == ()
    lost = '\n'.join(map(str, report.losses))
    assert whole.custom_data == {'seed': '42', LOST: lost}
    assert repair(whole.path, tmp_path / 'again').losses == ()
    assert BagReader(tmp_path / 'again').custom_data == whole.custom_data
    assert whole.topics == BagReader(damaged).topics


def test_the_repaired_bag_is_opened_by_others(damaged, tmp_path):
    report = repair(damaged, tmp_path / 'whole')
    with AnyReader([tmp_path / 'whole']) as reader:
        assert len(list(reader.messages())) == report.messages


def test_the_original_is_not_touched(damaged, tmp_path):
    before = (damaged / 'bag_0.mcap').read_bytes()
    repair(damaged, tmp_path / 'whole')
    assert [file.name for file in damaged.iterdir()] == ['bag_0.mcap']
    assert (damaged / 'bag_0.mcap').read_bytes() == before


def test_split_files_become_one(record, messages, tmp_path):
    repair(record(max_duration=1.0), tmp_path / 'whole')
    assert len(list((tmp_path / 'whole').glob('*.mcap'))) == 1
    assert list(BagReader(tmp_path / 'whole')) == messages


def test_nothing_is_overwritten(damaged, record, tmp_path):
    with pytest.raises(BagError, match='exists already'):
        repair(damaged, record('other'))


def test_a_bag_without_a_readable_message_is_not_repaired(damaged, tmp_path):
    file = damaged / 'bag_0.mcap'
    file.write_bytes(file.read_bytes()[:100])
    with pytest.raises(BagError, match='must hold at least one readable message'):
        repair(damaged, tmp_path / 'whole')
    assert not (tmp_path / 'whole').exists()
