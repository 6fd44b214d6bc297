# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node is seen by: topics, services, actions, diagnostics."""

import inspect
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from mlmem import Read, element_file, new_element, preset
from mlmem.loop.loop import Loop
from mlmem.procedure_table import PROCEDURES
from mlmem_ros.bag.queued_writer import QueuedWriter
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.contract import answers, services
from mlmem_ros.contract.commands import COMMAND_TOPICS
from mlmem_ros.contract.services import ACTION_TYPE_NAMES
from mlmem_ros.contract.streams import STREAMS
from mlmem_ros.contract.topics import DIAGNOSTICS_TOPIC, Topic
from mlmem_ros.host import ThrottledLog
from mlmem_ros.ros.node import diagnostics
from mlmem_ros.ros.node.diagnostics import Pace
from mlmem_tools.twin.watcher import Watcher
from mlmem_tools.twin.watching import Change, Comparison

from .table import table

INTERFACES = Path(__file__).resolve().parents[2] / 'mlmem_interfaces' / 'action'


def topics_page() -> str:
    """Return every topic, heard and published."""
    head = ['name', 'type', 'QoS', 'meaning']

    def rows(chosen: Iterable[Topic]) -> Iterator[list[str]]:
        for topic in chosen:
            name = topic.name if topic.name.startswith('/') else f'~/{topic.name}'
            yield [f'`{name}`', _type(topic.type), _qos(topic), topic.meaning]

    published = (*STREAMS.values(), DIAGNOSTICS_TOPIC)
    return (
        '# Topics\n\n'
        'All topics but `/diagnostics` are below the name of the node: `~/level` is '
        '`/mlmem/level` by default.\n\n'
        f'## The node listens to\n\n{table(head, rows(COMMAND_TOPICS))}\n\n'
        '## The node publishes\n\n'
        f'{table(head, rows(published))}\n\n'
        'Images and markers are made only while somebody subscribes to them.\n'
    )


def _type(name: str) -> str:
    package, _, kind = name.split('/')
    return f'{package}/{kind}'


def _qos(topic: Topic) -> str:
    qos = topic.qos
    depth = f'keep last {qos.depth}' if qos.depth else 'keep all'
    return f'{qos.reliability}, {qos.durability}, {depth}'.replace('_', ' ')


def services_page() -> str:
    """Return every service, and what `~/request` takes."""
    rows = [[f'`~/{name}`', _type(kind), told] for name, kind, told in services.NODE_SERVICES]
    simulator = [
        [f'`~/{name}`', _type(kind), told] for name, kind, told in services.SIMULATOR_SERVICES
    ]
    asked = [
        [f'`{name}`', ', '.join(f'`{key}` ({kind.name})' for key, kind in takes.items()) or '-']
        for name, takes in services.REQUEST_ARGUMENTS.items()
    ]
    return (
        '# Services\n\n'
        f'{table(["name", "type", "meaning"], rows)}\n\n'
        '## What `~/request` takes\n\n'
        f'The parameter `{services.NAME_ARGUMENT}` (string) names the procedure; the others are '
        f'its '
        'arguments.\n\n'
        f'{table(["procedure", "arguments"], asked)}\n\n'
        '`end` is `left`, `right` or `both`, by default `read.end`. `follow` moves the strain '
        'through points: `times` in s from its first tick, `strains` (tension positive), and '
        '`rates` in 1/s, or none for straight lines. `on` starts or ends a recording; `path` is '
        'by default `record.path`.\n\n'
        '## A simulator by the standard\n\n'
        'Where `simulation_interfaces` is installed (`ros-jazzy-simulation-interfaces`), each '
        'node, those of a bank too, answers its services; a step is a tick. The action '
        f'`~/{services.STEPS_ACTION}`, of a node that serves `actions`, tells of every step, and '
        f'its '
        'cancel ends it with the next one.\n\n'
        f'{table(["name", "type", "meaning"], simulator)}\n\n'
        '## What an answer holds\n\n'
        'The JSON object of a service, the texts of `~/outcome` and the result of an action hold '
        'these values, and so does what a client makes of them; `[1]` marks a number without '
        'unit. What is not known is left out, or is null.\n\n'
        f'{table(["value", "answer of", "meaning"], _held())}\n'
    )


def _held() -> Iterator[list[str]]:
    """Yield a row for every value that an answer of a procedure holds."""
    known = {name: answers.ANSWER_TYPES.get(name, answers.Decoded) for name in PROCEDURES}
    rows = {name: dict(answers.describe_fields(kind)) for name, kind in known.items()}
    told = {(key, row): None for each in rows.values() for key, row in each.items()}
    for key, row in told:
        by = [name for name, each in rows.items() if each.get(key) == row]
        rest = [name for name in rows if name not in by]
        few = len(by) < len(rest)
        whose = ', '.join(f'`{name}`' for name in (by if few else rest))
        names = f'`{key}`' + (f', `{row.short}`' if row.short else '')
        unit = f' [{row.unit}]' if row.unit else ''
        yield [names, whose if few else f'all but {whose}', row.text + unit]


def actions_page() -> str:
    """Return the definitions of the actions, without their licence."""
    told = [
        '# Actions',
        'The package `mlmem_interfaces` defines them: [how to build and use it](../actions.md). '
        'Units are in brackets; `[1]` marks a number without unit.',
    ]
    for name, kind in ACTION_TYPE_NAMES.items():
        lines = (INTERFACES / f'{kind}.action').read_text(encoding='utf-8').splitlines()
        about, definition = lines[3].removeprefix('# '), '\n'.join(lines[4:])
        told += [f'## `~/{name}`: {kind}', about, f'```\n{definition}\n```']
    return '\n\n'.join(told) + '\n'


def diagnostics_page() -> str:
    """Return the values of every status, taken from an element that has just been read."""
    element = new_element(preset('bits_1'))
    element.perform(Read())
    host = SimpleNamespace(refused=0, held_up='', log=SimpleNamespace(caught=0))
    known = element_file.Element(element.made, np.zeros(element.design.N))
    host.residual_monitor = Watcher(known, element, ThrottledLog(SimpleNamespace()))
    change = Change('cell', 1, 0.0, 0.0)
    host.residual_monitor.last = Comparison(1.0, np.zeros(2), change)
    with tempfile.TemporaryDirectory() as folder:
        recorder = QueuedWriter(BagWriter(Path(folder, 'bag')), dropped_topic='/dropped')
        recorder.close()
        recording = SimpleNamespace(full=False)
        host.sessions = SimpleNamespace(current=recording, status=recorder.status)
        asked = {
            'loop': (Pace.health, Pace(host).health(Loop(element, lambda *_: None))),
            **{name: (tell, tell(element)) for name, tell in diagnostics.ELEMENT_REPORTS.items()},
            'twin': (diagnostics.report_twin, diagnostics.report_twin(host)),
            'recorder': (diagnostics.report_recorder, diagnostics.report_recorder(host)),
        }
    rows = [
        [name, ', '.join(f'`{key}`' for key in health.values) or '-', _first_line(tell)]
        for name, (tell, health) in asked.items()
    ]
    return (
        '# Diagnostics\n\n'
        'The node publishes one status for each component on `/diagnostics`, once a second. '
        f'`hardware_id` is its full name. A warning stays for {diagnostics.WARNING_HOLD_REPORTS} '
        f'reports after '
        'its cause has gone.\n\n'
        f'{table(["status", "values", "meaning"], rows)}\n\n'
        '`faults` has a value for each fault that is set.\n'
    )


def _first_line(function: Any) -> str:
    return (inspect.getdoc(function) or '').partition('\n')[0]
