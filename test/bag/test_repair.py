# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A repaired bag is whole, and the damaged one is unchanged."""

import pytest
from mcap.reader import make_reader

from mlmem_ros.bag.contents import LOST_KEY
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_tools.cli.inspect import repair_bag


@pytest.fixture
def damaged(record):
    """A bag cut off in its sixteenth chunk, without metadata, as a killed recorder leaves it."""
    path = record(sync_each=True)
    (path / 'metadata.yaml').unlink()
    file = path / 'bag_0.mcap'
    with file.open('rb') as stream:
        sixteenth = make_reader(stream).get_summary().chunk_indexes[15]
    file.write_bytes(file.read_bytes()[: sixteenth.chunk_start_offset + 10])
    return path


def test_repair_saves_what_can_be_read(damaged, messages, tmp_path):
    saved, losses = repair_bag(damaged, tmp_path / 'whole')
    assert saved == 15  # a chunk holds one
    assert losses == BagReader(damaged).losses
    whole = BagReader(tmp_path / 'whole')
    assert list(whole) == messages[:15]
    assert whole.losses == ()
    lost = '\n'.join(map(str, losses))
    assert whole.custom_data == {LOST_KEY: lost}
    assert repair_bag(whole.path, tmp_path / 'again') == (15, ())
    assert BagReader(tmp_path / 'again').custom_data == whole.custom_data
    assert whole.topics == BagReader(damaged).topics


def test_repair_makes_one_of_split_files(record, messages, tmp_path):
    split = record(sync_each=True, max_bytes=1024, custom_data={'seed': '42'})
    assert len(list(split.glob('*.mcap'))) > 9
    repair_bag(split, tmp_path / 'whole')
    assert len(list((tmp_path / 'whole').glob('*.mcap'))) == 1
    whole = BagReader(tmp_path / 'whole')
    assert list(whole) == messages
    assert whole.custom_data == {'seed': '42'}


def test_bag_without_a_message_is_not_repaired(damaged, tmp_path):
    file = damaged / 'bag_0.mcap'
    file.write_bytes(file.read_bytes()[:100])
    with pytest.raises(BagError, match='must hold at least one readable message'):
        repair_bag(damaged, tmp_path / 'whole')
    assert not (tmp_path / 'whole').exists()
