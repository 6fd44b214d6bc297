# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What was synced survives the sudden death of the recorder."""

import subprocess
import sys

from mlmem_ros.bag.metadata import read_metadata
from mlmem_ros.bag.reader import BagReader
from mlmem_tools.repairing import repair

# Records without end, syncs after every tenth message and then says how many are safe.
RECORDER = """
import itertools, sys
from mlmem_ros.bag.writer import BagWriter

writer = BagWriter(sys.argv[1], custom_data={'seed': '42'})
writer.add_topic('/n', 'std_msgs/msg/UInt64')
for i in itertools.count(1):
    writer.write('/n', b'\\0\\1\\0\\0' + i.to_bytes(8, 'little'), i)
    if i % 10 == 0:
        writer.sync()
        print(i, flush=True)
"""


def test_after_kill_9_every_synced_message_is_readable(tmp_path):
    path = tmp_path / 'bag'
    with subprocess.Popen(
        [sys.executable, '-c', RECORDER, path], stdout=subprocess.PIPE, text=True
    ) as recorder:
        for _ in range(5):
            recorder.stdout.readline()
        recorder.kill()
        synced = max([50, *map(int, recorder.stdout)])
    reader = BagReader(path)
    times = [message.log_time for message in reader]
    assert times == [*range(1, len(times) + 1)]
    assert len(times) >= synced
    assert reader.custom_data == {'seed': '42'}
    assert reader.losses, 'a bag that was not closed must say so'
    # metadata.yaml agrees with a sync, whole, no matter when the recorder died.
    metadata = read_metadata(path)
    assert metadata.message_count % 10 == 0
    assert synced - 10 <= metadata.message_count <= len(times)

    report = repair(path, tmp_path / 'whole')
    assert report.messages == len(times)
    assert BagReader(tmp_path / 'whole').losses == ()
