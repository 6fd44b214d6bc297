# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A session with one random change, made from a number; its MCAP file stays whole.

What is changed is the content of one record: a value in the JSON of header, command or hash, the
text of that JSON, the bytes of any message, the definition of a type, the type of a topic, a
time, a name.
"""

from __future__ import annotations

import json
import random
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from mlmem_ros.bag import jazzy
from mlmem_ros.bag.contents import Definition, Message, TopicInfo
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.bag.writer import BagWriter

STRING = 'std_msgs/msg/String'
TOLD = ('/mlmem/session', '/mlmem/session/command', '/mlmem/session/state_hash')
VALUES: tuple[Any, ...] = (
    None, True, False, -1, 0, 1, 0.5, 1e15, 10**15, 10**9, 2**63, 10**400, -(10**30), 1e300,
    float('inf'), float('nan'), '', '5', '[/red]', '[link=x]', '\ud800', '\x1b[2J', 'x' * 100_000,
    [], [None], [[1.0]], [1e999] * 3, {}, {'a': 1}, {'kind': 'Write'}, list(range(1000)),
)  # fmt: skip
TEXTS = (
    '', '{', '[]', 'null', '5', '"x"', '[' * 100_000, '{"a":' * 50_000, '{"tick": NaN}',
    '{"tick": ' + '9' * 5000 + '}', '{"tick": 1e999}', '\x00', '{"tick": 1, "tick": null}', '{}',
)  # fmt: skip
SCHEMAS = (
    ('ros2msg', 'string[100000000] x\n'),
    ('ros2msg', ' ' * 2_000_000),
    ('ros2msg', 'int32 data\n'),
    ('ros2msg', '<<<'),
    ('ros2msg', ''),
    ('ros2idl', 'module demo { module msg { struct A { string x[100000000]; }; }; };\n'),
    ('jsonschema', '{}'),
)
NAMES = ('[/red]', '[bold', '/mlmem/[/]', '\x1b]0;x\x07', 'a\nb', 'x' * 100_000, '', ':smile:')


@dataclass
class Tampered:
    """A session to be written: topics with their definitions, messages, custom data."""

    topics: dict[str, TopicInfo]
    definitions: dict[str, Definition]
    messages: list[Message]
    custom: dict[str, str] = field(default_factory=dict)
    what: str = ''

    @classmethod
    def read(cls, path: Path) -> Tampered:
        """Return a session as it is, less the topics on which nothing was said."""
        reader = BagReader(path)
        topics = {name: info for name, info in reader.topics.items() if info.message_count}
        definitions = {name: reader.definition(name) for name, info in topics.items()}
        return cls(topics, definitions, list(reader))

    def copy(self) -> Tampered:
        """Return one to change."""
        return Tampered(dict(self.topics), dict(self.definitions), list(self.messages))

    def write(self, path: Path) -> None:
        """Write it, whatever it holds, as a whole bag."""
        with BagWriter(path, custom_data=self.custom) as writer:
            for name, info in self.topics.items():
                definition = self.definitions[name]
                writer.add_topic(name, info.type, info.offered_qos, definition=definition)
            for message in self.messages:
                writer.write(message.topic, message.cdr, message.log_time)

    def tamper(self, number: int) -> Tampered:
        """Return a copy with one change, decided by a number."""
        chance = random.Random(number)
        made = self.copy()
        change = chance.choices((_value, _text, _bytes, _schema, _type, _time, _name), _SHARES)[0]
        made.what = f'{number}: {change.__name__[1:]} {change(made, chance)}'[:200]
        return made


_SHARES = (10, 2, 4, 4, 1, 1, 1)


def string(text: str) -> bytes:
    """Return a std_msgs/msg/String as CDR, lone surrogates and all."""
    raw = text.encode('utf-8', 'surrogatepass') + b'\0'
    return b'\0\1\0\0' + len(raw).to_bytes(4, 'little') + raw


def _pick(made: Tampered, chance: random.Random, told: bool = False) -> int:
    """Return the index of a message, each topic as likely as the other."""
    found = {message.topic for message in made.messages}
    topic = chance.choice(sorted(found.intersection(TOLD) if told else found))
    return chance.choice([i for i, m in enumerate(made.messages) if m.topic == topic])


def _value(made: Tampered, chance: random.Random) -> str:
    """Change or remove a value in the JSON of header, command or hash."""
    index = _pick(made, chance, told=True)
    message = made.messages[index]
    values = json.loads(jazzy.deserialize_message(message.cdr, STRING).data)
    node, path = values, []
    while True:
        key = chance.choice(sorted(node) if isinstance(node, dict) else range(len(node)))
        path.append(key)
        if isinstance(node[key], dict | list) and node[key] and chance.random() < 0.85:
            node = node[key]
            continue
        break
    if isinstance(node, dict) and chance.random() < 0.15:
        del node[key]
        told = 'left out'
    else:
        node[key] = chance.choice(VALUES)
        told = repr(node[key])[:40]
    made.messages[index] = message._replace(cdr=string(json.dumps(values)))
    return f'{message.topic} {path} {told}'


def _text(made: Tampered, chance: random.Random) -> str:
    """Replace the JSON by a text that may be invalid."""
    index = _pick(made, chance, told=True)
    text = chance.choice(TEXTS)
    made.messages[index] = made.messages[index]._replace(cdr=string(text))
    return f'{made.messages[index].topic} {text[:40]!r}'


def _bytes(made: Tampered, chance: random.Random) -> str:
    """Change the bytes of a message: some, a length, the end, all."""
    index = _pick(made, chance)
    message = made.messages[index]
    cdr = bytearray(message.cdr)
    way = chance.randrange(5)
    if way == 0:
        for _ in range(chance.randint(1, 8)):
            cdr[chance.randrange(len(cdr))] = chance.randrange(256)
    elif way == 1:
        del cdr[chance.randrange(len(cdr)) :]
    elif way == 2:
        cdr += chance.randbytes(chance.randint(1, 100))
    elif way == 3 and len(cdr) >= 12:
        at = 4 * chance.randrange(1, len(cdr) // 4)
        cdr[at : at + 4] = chance.choice((0, 1, 2**31 - 1, 2**32 - 4, 2**32 - 1)).to_bytes(
            4, 'little'
        )
    else:
        cdr[4:] = chance.randbytes(chance.randint(0, 64))
    made.messages[index] = message._replace(cdr=bytes(cdr))
    return f'{message.topic} way {way}'


def _schema(made: Tampered, chance: random.Random) -> str:
    """Change the definition of a topic's type, or its hash; or add a topic of an unknown type."""
    encoding, text = chance.choice(SCHEMAS)
    topic = chance.choice(sorted({message.topic for message in made.messages}))
    info, first = made.topics[topic], made.messages[0]
    if chance.random() < 0.4:
        topic, info = '/demo', TopicInfo('/demo', 'demo/msg/A')
        made.topics[topic] = info
        made.messages.append(first._replace(topic=topic, cdr=b'\0\1\0\0' + b'\xff' * 64))
    digest = chance.choice(('', 'RIHS01_' + '0' * 64, 'nonsense'))
    made.definitions[topic] = Definition(info.type, text, encoding, digest)
    return f'{topic} {encoding} {text[:40]!r} {digest[:10]}'


def _type(made: Tampered, chance: random.Random) -> str:
    """Give a topic another type that ships with ROS."""
    topic = chance.choice(sorted(made.topics))
    kind = chance.choice(
        ('std_msgs/msg/Float64', STRING, 'std_msgs/msg/Empty', 'sensor_msgs/msg/Imu',
         'std_msgs/msg/Float64MultiArray', 'tf2_msgs/msg/TFMessage', '', '[/]', 'a/b/c/d')
    )  # fmt: skip
    made.topics[topic] = replace(made.topics[topic], type=kind)
    try:
        made.definitions[topic] = jazzy.find_definition(kind)
    except BagError:
        made.definitions[topic] = Definition(kind, '', '')
    return f'{topic} {kind}'


def _time(made: Tampered, chance: random.Random) -> str:
    """Move a message in time."""
    index = chance.randrange(len(made.messages))
    time = chance.choice((0, 1, 2**62, 2**63 - 1))
    made.messages[index] = made.messages[index]._replace(log_time=time)
    return f'{made.messages[index].topic} {time}'


def _name(made: Tampered, chance: random.Random) -> str:
    """Give a topic another name, or the bag custom data."""
    name = chance.choice(NAMES)
    if chance.random() < 0.3:
        made.custom = {name[:500]: chance.choice(NAMES)}
        return f'custom data {name[:40]!r}'
    old = chance.choice(sorted(made.topics))
    made.topics[name] = replace(made.topics.pop(old), name=name)
    made.definitions[name] = made.definitions.pop(old)
    for index, message in enumerate(made.messages):
        if message.topic == old:
            made.messages[index] = message._replace(topic=name)
    return f'{old} {name[:40]!r}'
