# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The messages of a bag made of MCAP files."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from mcap.records import Channel, Schema

from .contents import Loss, Message
from .definitions import Definition
from .errors import BagError
from .mcap_scan import Block, McapScan
from .metadata import TopicInfo
from .qos import QosProfile, parse_profiles


class McapSource:
    """Reads any number of MCAP files as one bag, holding no more than a few chunks in memory.

    Attributes:
        topics: The topics by name, with the number of messages that can be read.
        definitions: The message definitions of the files.
        losses: What cannot be read.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        """Scan the files.

        Args:
            files: The files, in the order they were written.

        Raises:
            BagError: None of the files can be read.
        """
        self.topics: dict[str, TopicInfo] = {}
        self.definitions: list[Definition] = []
        self.losses: list[Loss] = []
        self._scans: list[McapScan] = []
        errors: list[BagError] = []
        for file in files:
            try:
                scan = McapScan(file)
            except BagError as error:
                errors.append(error)
                size = file.stat().st_size if file.is_file() else 0
                self.losses.append(Loss(file, 0, size, str(error)))
                continue
            self._scans.append(scan)
            self.losses.extend(scan.losses)
            self._collect(scan)
        if errors and not self._scans:
            raise errors[0]

    @property
    def span(self) -> tuple[int, int] | None:
        """Earliest and latest log time in nanoseconds, or None without messages."""
        blocks = [block for scan in self._scans for block in scan.blocks]
        if not blocks:
            return None
        return min(block.earliest for block in blocks), max(block.latest for block in blocks)

    @property
    def metadata_text(self) -> str | None:
        """The last metadata record of the files, or None without one."""
        texts = [scan.metadata for scan in self._scans if scan.metadata is not None]
        return texts[-1] if texts else None

    def messages(self, topics: Collection[str]) -> Iterator[Message]:
        """Read messages in the order of their log times.

        Args:
            topics: Names of the wanted topics.

        Yields:
            Messages; those with equal log times in the order they were written.

        Raises:
            BagError: A file has changed since it was opened.
        """
        blocks = (
            (scan, block, labels)
            for scan in self._scans
            if (labels := _labels(scan, topics))
            for block in scan.blocks
            if not labels.keys().isdisjoint(block.counts)
        )
        entries = (_entries(number, *block) for number, block in enumerate(blocks))
        for *_, message in heapq.merge(*entries):
            if message is not None:
                yield message

    def _collect(self, scan: McapScan) -> None:
        for channel in scan.channels.values():
            count = sum(block.counts[channel.id] for block in scan.blocks)
            info = _topic_info(scan, channel)
            info = self.topics.setdefault(channel.topic, info)
            self.topics[channel.topic] = replace(info, message_count=info.message_count + count)
        self.definitions.extend(_definition(schema) for schema in scan.schemas.values())


def _labels(scan: McapScan, topics: Collection[str]) -> dict[int, tuple[str, str]]:
    """Return topic and type of the wanted channels, by id."""
    return {
        number: (channel.topic, _type_name(scan, channel))
        for number, channel in scan.channels.items()
        if channel.topic in topics
    }


def _entries(
    number: int, scan: McapScan, block: Block, labels: Mapping[int, tuple[str, str]]
) -> Iterator[tuple[int, int, int, Message | None]]:
    """Yield the messages of a block with their sort key: time, block, place in the block.

    The first entry holds no message, so that a block is read only when a merge reaches its start.
    """
    yield block.earliest, number, -1, None
    yield from sorted(
        (m.log_time, number, place,
         Message(*labels[m.channel_id], m.log_time, m.publish_time, m.data))
        for place, m in enumerate(scan.messages(block, labels))
    )  # fmt: skip


def _type_name(scan: McapScan, channel: Channel) -> str:
    schema = scan.schemas.get(channel.schema_id)
    return schema.name if schema else ''


def _topic_info(scan: McapScan, channel: Channel) -> TopicInfo:
    return TopicInfo(
        name=channel.topic,
        type=_type_name(scan, channel),
        serialization_format=channel.message_encoding,
        offered_qos_profiles=_profiles(channel.metadata.get('offered_qos_profiles', '')),
        type_description_hash=channel.metadata.get('topic_type_hash', ''),
    )


@lru_cache(maxsize=256)  # most topics offer the same
def _profiles(text: str) -> tuple[QosProfile, ...]:
    try:
        return parse_profiles(text)
    except BagError:
        return ()  # bad QoS is no reason to refuse the messages


def _definition(schema: Schema) -> Definition:
    return Definition(schema.name, schema.data.decode(errors='replace'), schema.encoding)
