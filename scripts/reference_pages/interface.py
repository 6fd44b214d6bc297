# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node is seen by: topics, services, actions, diagnostics."""

import inspect
import re
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from mlmem import MemoryElement, Read, element_file, load_element
from mlmem.loop.loop import Loop
from mlmem.procedure_table import PROCEDURES
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.contract import answers, requests
from mlmem_ros.contract.commands import COMMAND_TOPICS
from mlmem_ros.contract.requests import ACTION_TYPE_NAMES, PARAMETER_TYPES, REQUEST_ARGUMENTS
from mlmem_ros.contract.streams import STREAMS
from mlmem_ros.contract.topics import DIAGNOSTICS_TOPIC, Topic
from mlmem_ros.host import SessionPlan, ThrottledLog
from mlmem_ros.host.recording import BagRecording
from mlmem_ros.host.settings import RecordSettings
from mlmem_ros.ros.node import diagnostics
from mlmem_ros.ros.node.diagnostics import Pace
from mlmem_tools.identification.monitor_node import report_twin
from mlmem_tools.identification.watching import Change, Comparison, ResidualMonitor

from .table import make_list, make_table

ACTION_FOLDER = Path(__file__).resolve().parents[2] / 'mlmem_interfaces' / 'action'


def generate_interfaces() -> dict[str, str]:
    """Return the tables of topics, services, actions, answers and diagnostics."""
    published = (*STREAMS.values(), DIAGNOSTICS_TOPIC)
    rows = [
        (
            f'`{name}`',
            ', '.join(f'`{key}` ({PARAMETER_TYPES[kind].lower()})' for key, kind in takes.items()),
        )
        for name, takes in REQUEST_ARGUMENTS.items()
        if takes
    ]
    return {
        'subscribed': _list_topics(COMMAND_TOPICS),
        'published': _list_topics(published),
        'services': _list_services(requests.NODE_SERVICES),
        'simulator': _list_services(requests.SIMULATOR_SERVICES),
        'requests': make_list(rows),
        'answers': make_table(['value', 'answer of', 'meaning'], _list_values()),
        'actions': make_table(['action', 'what it does', 'goal', 'result'], _list_actions()),
        'goals': make_list(_describe_section(0)),
        'feedback': make_list(_describe_section(2)),
        'diagnostics': _list_diagnostics(),
    }


def generate_actions() -> dict[str, str]:
    """Return the text of every action whose result is declared, by the name of its file."""
    texts = {}
    for request, kind in ACTION_TYPE_NAMES.items():
        answer = answers.ANSWER_TYPES.get(request, answers.Decoded)
        fields = list(_describe_wire_fields(answer))
        if not fields:  # a self-test reports checks
            continue
        path = ACTION_FOLDER / f'{kind}.action'
        goal, result, feedback = path.read_text(encoding='utf-8').split('---\n')
        error = re.sub(r'(\nstring error [^\n]*\n).*', r'\1', result, flags=re.DOTALL)
        lines = (f'{f"{wire} {name}":26}# {meaning}\n' for wire, name, meaning in fields)
        texts[path.name] = '---\n'.join([goal, error + ''.join(lines), feedback])
    return texts


def _describe_wire_fields(kind: type[answers.Answer]) -> Iterator[tuple[str, str, str]]:
    """Yield type, name and meaning of the fields that an answer has in an action's result."""
    for name, row in answers.describe_fields(kind):
        unit = f' [{row.unit}]' if row.unit else ''
        absent = 'NaN' if row.absent != row.absent else f'{row.absent}'
        is_explained = row.absent is None or absent in row.text
        unknown = '' if is_explained else f'; {absent}: not known'
        for field_name, end in answers.wire_fields(name, row):
            text = f'{end} end: {row.text}' if end else row.text
            yield row.wire, field_name, f'{text}{unit}{unknown}'


def _list_topics(chosen: Iterable[Topic]) -> str:
    rows = [
        [
            f'`{topic.name}`' if topic.name.startswith('/') else f'`~/{topic.name}`',
            _format_type(topic.type),
            _format_qos(topic),
            topic.meaning,
        ]
        for topic in chosen
    ]
    return make_table(['name', 'type', 'QoS', 'meaning'], rows)


def _list_services(chosen: Iterable[tuple[str, str, str]]) -> str:
    rows = [[f'`~/{name}`', _format_type(kind), meaning] for name, kind, meaning in chosen]
    return make_table(['name', 'type', 'meaning'], rows)


def _format_type(name: str) -> str:
    package, _, kind = name.split('/')
    return f'{package}/{kind}'


def _format_qos(topic: Topic) -> str:
    qos = topic.qos
    latched = '' if qos.durability == 'volatile' else ', latched'
    return f'{qos.reliability}{latched}, {qos.depth or "all"}'.replace('_', ' ')


def _list_values() -> Iterator[list[str]]:
    """Yield a row for every value that an answer of a procedure holds."""
    known = {name: answers.ANSWER_TYPES.get(name, answers.Decoded) for name in PROCEDURES}
    rows = {name: dict(answers.describe_fields(kind)) for name, kind in known.items()}
    told = {(key, row): None for each in rows.values() for key, row in each.items()}
    for key, row in told:
        by = [name for name, each in rows.items() if each.get(key) == row]
        rest = rows.keys() - set(by)
        whose = ', '.join(f'`{name}`' for name in by) if len(by) < len(rest) else ''
        names = f'`{key}`' + (f', `{row.short}`' if row.short else '')
        unit = f' [{row.unit}]' if row.unit else ''
        yield [names, whose, row.text + unit]


def _read_action(kind: str) -> list[str]:
    """Return the lines of an action without its licence; the first says what it does."""
    return (ACTION_FOLDER / f'{kind}.action').read_text(encoding='utf-8').splitlines()[3:]


def _read_fields(kind: str) -> list[dict[str, str]]:
    """Return goal, result and feedback of an action: the meaning of each field by its name."""
    sections = '\n'.join(_read_action(kind)[1:]).split('\n---\n')
    return [
        {
            line.split()[1]: line.partition('# ')[2]
            for line in section.splitlines()
            if ' = ' not in line.partition('#')[0]
        }
        for section in sections
    ]


def _describe_section(section: int) -> list[tuple[str, str]]:
    """Return every field that the goals (0), results (1) or feedback (2) have."""
    fields: dict[str, str] = {}
    for kind in ACTION_TYPE_NAMES.values():
        fields |= _read_fields(kind)[section]
    return [(f'`{name}`', meaning) for name, meaning in fields.items()]


def _list_actions() -> Iterator[list[str]]:
    """Yield a row for every action."""
    decoded = [*_read_fields('Write')[1]]
    for name, kind in ACTION_TYPE_NAMES.items():
        goal, result, _ = _read_fields(kind)
        shared = [field for field in result if field in decoded]
        own = [field for field in result if field not in decoded]
        like_write = kind != 'Write' and shared == decoded
        fields = ', '.join(f'`{field}`' for field in (own if like_write else result))
        yield [
            f'`~/{name}`: {kind}',
            _read_action(kind)[0].removeprefix('# '),
            ', '.join(f'`{field}`' for field in goal),
            ', '.join(filter(None, ('as `Write`' if like_write else '', fields))),
        ]


def _list_diagnostics() -> str:
    """Return the values of every status, taken from an element that has just been read."""
    element = MemoryElement(load_element('bits_1'))
    element.perform(Read())
    host = SimpleNamespace(held_up='', log=SimpleNamespace(caught=0, refusals=0))
    known = element_file.Element(element.made, np.zeros(element.design.N))
    monitor = ResidualMonitor(known, None)
    monitor.last = Comparison(1.0, np.zeros(2), 0.0, Change('cell', 1, 0.0, 0.0))
    with tempfile.TemporaryDirectory() as folder:
        plan, log = SessionPlan('/mlmem', RecordSettings()), ThrottledLog(lambda *_: None)
        writer = BagWriter(Path(folder, 'bag'))
        recording = BagRecording(plan, log, time.time_ns, writer, ())
        recording.close()
        host.sessions = SimpleNamespace(current=recording)
        asked = {
            'loop': (Pace.report_health, Pace(host).report_health(Loop(element, lambda *_: None))),
            **{name: (tell, tell(element)) for name, tell in diagnostics.ELEMENT_REPORTS.items()},
            'recorder': (diagnostics.report_recorder, diagnostics.report_recorder(host)),
            'twin': (report_twin, report_twin(monitor)),
        }
    rows = [
        [name, ', '.join(f'`{key}`' for key in health.values) or '-', _first_line(tell)]
        for name, (tell, health) in asked.items()
    ]
    return make_table(['status', 'values', 'meaning'], rows)


def _first_line(function: Any) -> str:
    return (inspect.getdoc(function) or '').partition('\n')[0]
