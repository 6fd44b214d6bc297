# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Make a whole bag from the readable part of a damaged one."""

from __future__ import annotations

from os import PathLike

from mlmem_ros.bag.contents import LOST_KEY, Loss
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.bag.writer import BagWriter


def repair_bag(
    source: str | PathLike[str], destination: str | PathLike[str]
) -> tuple[int, tuple[Loss, ...]]:
    """Copy all that can be read of a bag into a new one, whose directory must not exist; return
    how many messages were saved, and what could not be read.

    Messages, times, definitions, QoS and custom data are kept; the new bag has one file, and its
    custom data lists what was lost.

    Raises:
        BagError: Nothing can be read, or the destination exists or cannot be written.
    """
    reader = BagReader(source)
    if not reader.message_count:
        reasons = '; '.join(map(str, reader.losses)) or 'the bag is empty'
        raise BagError(f'{source} must hold at least one readable message; {reasons}.')
    custom_data = dict(reader.custom_data)
    if lost := [*custom_data.get(LOST_KEY, '').splitlines(), *map(str, reader.losses)]:
        custom_data[LOST_KEY] = '\n'.join(lost)
    with BagWriter(destination, custom_data=custom_data) as writer:
        for info in reader.topics.values():
            writer.add_topic(
                info.name,
                info.type,
                info.offered_qos,
                definition=reader.definition(info.name),
                serialization_format=info.serialization_format,
            )
        for message in reader.messages():
            writer.write(message.topic, message.cdr, message.log_time, message.publish_time)
    return writer.message_count, reader.losses
