// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// Read bags with Foxglove's own readers and decode every message.
//   npm install @mcap/core @mcap/nodejs @mcap/support @foxglove/rosmsg @foxglove/rosmsg2-serialization
//   node foxglove_check.mjs SESSION/*.mcap
import { open } from 'node:fs/promises';
import { McapIndexedReader } from '@mcap/core';
import { FileHandleReadable } from '@mcap/nodejs';
import { loadDecompressHandlers } from '@mcap/support';
import rosmsg from '@foxglove/rosmsg';
import serialization from '@foxglove/rosmsg2-serialization';

const decompressHandlers = await loadDecompressHandlers();
for (const path of process.argv.slice(2)) {
  const readable = new FileHandleReadable(await open(path));
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const decoders = new Map();
  const counts = new Map();
  for await (const record of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(record.channelId);
    if (!decoders.has(channel.id)) {
      const schema = reader.schemasById.get(channel.schemaId);
      const text = new TextDecoder().decode(schema.data);
      decoders.set(channel.id, new serialization.MessageReader(rosmsg.parse(text, { ros2: true })));
    }
    decoders.get(channel.id).readMessage(record.data);
    counts.set(channel.topic, (counts.get(channel.topic) ?? 0) + 1);
  }
  const total = [...counts.values()].reduce((a, b) => a + b, 0);
  console.log(path, reader.header.profile, total, Object.fromEntries(counts));
  if (BigInt(total) !== reader.statistics.messageCount) {
    console.error(`expected ${reader.statistics.messageCount} messages`);
    process.exitCode = 1;
  }
}
