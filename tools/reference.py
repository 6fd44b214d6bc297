# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Write the pages of docs/reference and the SROS 2 policy from the code.

.venv/bin/python tools/reference.py
"""

import argparse
import dataclasses
import inspect
import json
import re
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np

from mlmem_lab import standard_problems
from mlmem_lab.standard_problems import verdict
from mlmem_ros import element_file, rig
from mlmem_ros.bag import jazzy, mcap_file, metadata, writer
from mlmem_ros.bag.recorder import Recorder
from mlmem_ros.bag.writer import BagWriter
from mlmem_ros.checks import check
from mlmem_ros.cli import laboratory
from mlmem_ros.cli.main import SUBCOMMANDS, parser
from mlmem_ros.contract import requests, services, topics, word_code
from mlmem_ros.contract.goals import ACTIONS
from mlmem_ros.contract.topics import Topic
from mlmem_ros.described import Description
from mlmem_ros.device import (
    Read,
    calibration,
    new_element,
    preset,
    presets,
    quick_moves,
    snapshot,
    trims,
)
from mlmem_ros.device.loop import Loop
from mlmem_ros.host import ThrottledLog, calibration_file, design_check, state_file
from mlmem_ros.host.watcher import Watcher
from mlmem_ros.physics import Specimen
from mlmem_ros.rig import driver, frames, hello
from mlmem_ros.ros.node import command_line, components, diagnostics
from mlmem_ros.ros.node.declarations import declarations, is_listed
from mlmem_ros.ros.node.diagnostics import Pace
from mlmem_ros.session import messages
from mlmem_ros.twin.watching import Change, Comparison

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / 'docs' / 'reference'
POLICY = ROOT / 'config' / 'sros2_policy.xml'
INTERFACES = ROOT / 'mlmem_interfaces' / 'action'

GENERATED = '<!-- Made by tools/reference.py from the code; edit that. -->\n\n'


def pages() -> dict[str, str]:
    """Return every page by the name of its file."""
    made = {
        'topics.md': _topics(),
        'services.md': _services(),
        'actions.md': _actions(),
        'diagnostics.md': _diagnostics(),
        'parameters.md': _parameters(),
        'commands.md': _commands(),
        'files.md': _files(),
        'rig.md': _rig(),
        'checks.md': _checks(),
        'presets.md': _presets(),
        'standard_problems.md': _standard_problems(),
    }
    return {name: GENERATED + text for name, text in made.items()}


def policy() -> str:
    """Return the SROS 2 policy, with the present services and actions of node and client."""
    text = POLICY.read_text(encoding='utf-8')
    own = ''.join(f'            <service>~/{name}</service>\n' for name, *_ in services.SERVICES)
    text = re.sub(
        r'(<services reply="ALLOW">\n).*?( *<service>~/change_state)',
        lambda found: found[1] + own + found[2],
        text,
        count=1,
        flags=re.DOTALL,
    )
    for rule, above in (('execute', '~'), ('call', '/mlmem')):
        listed = ''.join(f'            <action>{above}/{name}</action>\n' for name in ACTIONS)
        text = re.sub(
            rf'(<actions {rule}="ALLOW">[^\n]*\n).*?( *</actions>)',
            lambda found, listed=listed: found[1] + listed + found[2],
            text,
            flags=re.DOTALL,
        )
    return text


def _table(head: list[str], rows: Iterable[list[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ['---'] * len(head), *rows]
    return '\n'.join(
        '| ' + ' | '.join(cell.replace('|', '&#124;') for cell in line) + ' |' for line in lines
    )


# --- topics, services and actions ----------------------------------------------------------


def _topics() -> str:
    head = ['name', 'type', 'QoS', 'meaning']

    def rows(chosen: Iterable[Topic]) -> Iterator[list[str]]:
        for topic in chosen:
            name = topic.name if topic.name.startswith('/') else f'~/{topic.name}'
            yield [f'`{name}`', _type(topic.type), _qos(topic), topic.meaning]

    return (
        '# Topics\n\n'
        'All topics but `/diagnostics` are below the name of the node: `~/level` is '
        '`/mlmem/level` by default.\n\n'
        f'## The node listens to\n\n{_table(head, rows(topics.COMMANDS))}\n\n'
        '## The node publishes\n\n'
        f'{_table(head, rows((*topics.STREAMS, *topics.VIEWS, topics.DIAGNOSTICS)))}\n\n'
        'Images and markers are made only while somebody subscribes to them.\n'
    )


def _type(name: str) -> str:
    package, _, kind = name.split('/')
    return f'{package}/{kind}'


def _qos(topic: Topic) -> str:
    qos = topic.qos
    depth = f'keep last {qos.depth}' if qos.depth else 'keep all'
    return f'{qos.reliability}, {qos.durability}, {depth}'.replace('_', ' ')


def _services() -> str:
    rows = [[f'`~/{name}`', _type(kind), told] for name, kind, told in services.SERVICES]
    asked = [
        [f'`{name}`', ', '.join(f'`{key}` ({kind.name})' for key, kind in takes.items()) or '-']
        for name, takes in requests.REQUESTS.items()
    ]
    return (
        '# Services\n\n'
        f'{_table(["name", "type", "meaning"], rows)}\n\n'
        '## What `~/request` takes\n\n'
        f'The parameter `{requests.NAME}` (string) names the procedure; the others are its '
        'arguments.\n\n'
        f'{_table(["procedure", "arguments"], asked)}\n\n'
        '`end` is `left`, `right` or `both`, by default `read.end`. `follow` moves the strain '
        'through points: `times` in s from its first tick, `strains` (tension positive), and '
        '`rates` in 1/s, or none for straight lines. `on` starts or ends a recording; `path` is '
        'by default `record.path`.\n'
    )


def _actions() -> str:
    """Return the definitions of the actions, without their licence."""
    told = [
        '# Actions',
        'The package `mlmem_interfaces` defines them: [how to build and use it](../actions.md). '
        'Units are in brackets; `[1]` marks a number without unit.',
    ]
    for name, kind in ACTIONS.items():
        lines = (INTERFACES / f'{kind}.action').read_text(encoding='utf-8').splitlines()
        about, definition = lines[3].removeprefix('# '), '\n'.join(lines[4:])
        told += [f'## `~/{name}`: {kind}', about, f'```\n{definition}\n```']
    return '\n\n'.join(told) + '\n'


# --- diagnostics ---------------------------------------------------------------------------


def _diagnostics() -> str:
    """Return the values of every status, taken from an element that has just been read."""
    element = new_element(preset('bits_1'))
    element.perform(Read())
    host = SimpleNamespace(refused=0, log=SimpleNamespace(caught=0))
    known = element_file.Element(element.made, np.zeros(element.design.N))
    host.watcher = Watcher(known, element, ThrottledLog(SimpleNamespace()))
    change = Change('cell', 1, 0.0, 0.0)
    host.watcher.last = Comparison(1.0, np.zeros(2), change)
    with tempfile.TemporaryDirectory() as folder:
        recorder = Recorder(BagWriter(Path(folder, 'bag')), dropped_topic='/dropped')
        recorder.close()
        recording = SimpleNamespace(status=recorder.status, full=False)
        host.sessions = SimpleNamespace(current=recording)
        asked = {
            'loop': (Pace.health, Pace(host).health(Loop(element, lambda *_: None))),
            **{name: (tell, tell(element)) for name, tell in components.ELEMENT.items()},
            'twin': (diagnostics.twin, diagnostics.twin(host)),
            'recorder': (diagnostics.recorder, diagnostics.recorder(host)),
        }
    rows = [
        [name, ', '.join(f'`{key}`' for key in health.values) or '-', _first_line(tell)]
        for name, (tell, health) in asked.items()
    ]
    return (
        '# Diagnostics\n\n'
        'The node publishes one status for each component on `/diagnostics`, once a second. '
        f'`hardware_id` is its full name. A warning stays for {components.HOLD} reports after '
        'its cause has gone.\n\n'
        f'{_table(["status", "values", "meaning"], rows)}\n\n'
        '`faults` has a value for each fault that is set.\n'
    )


def _first_line(function: Any) -> str:
    return (inspect.getdoc(function) or '').partition('\n')[0]


# --- parameters ----------------------------------------------------------------------------


def _parameters() -> str:
    listed: dict[str, list[list[str]]] = {}
    others: dict[str, list[list[str]]] = {}
    for name, default, description in declarations():
        legal = '0 to p - 1' if name == 'target_level' else _range(description)
        row = [f'`{name}`', _default(default), description.unit, legal, description.text]
        groups = listed if is_listed(name) else others
        groups.setdefault(name.partition('.')[0] if '.' in name else '', []).append(row)
    head = ['parameter', 'default', 'unit', 'range', 'meaning']

    def tables(groups: Mapping[str, list[list[str]]]) -> str:
        return '\n'.join(
            f'### {f"`{group}.*`" if group else "The node"}\n\n{_table(head, rows)}\n'
            for group, rows in groups.items()
        )

    return (
        '# Parameters\n\n'
        'Defaults are those of the preset `case_2`. `target_level`, `time.speed`, `faults.*` and '
        '`record.*`, except `record.hash_every`, may be set at any time, all others only while '
        'the node is unconfigured. '
        'Times are in time units sqrt(m / k_r), `scale.time` seconds each; lengths in cells, '
        '`scale.length` metres each.\n\n'
        f'## Listed by every node\n\n{tables(listed)}\n'
        '## Brought by a preset or a file\n\n'
        'A [parameter file](files.md#parameter-files) or `-p NAME:=VALUE` sets these at the '
        'start, and `ros2 param get` and `set` know them by name. A node lists those that it was '
        'given. '
        '`ros2 param dump` saves what is listed: with `design.preset`, `design.file` and '
        '`design.digest` that is the whole element.\n\n'
        f'{tables(others)}'
    )


def _default(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return value or "''"
    return f'{value:.6g}' if isinstance(value, float) else str(value)


def _range(description: Description) -> str:
    if description.choices:
        return ', '.join(description.choices)
    low, high = description.low, description.high
    if low is not None and high is not None:
        return f'{low:g} to {high:g}'
    if low is not None:
        return f'from {low:g}'
    return f'up to {high:g}' if high is not None else ''


# --- commands ------------------------------------------------------------------------------


def _commands() -> str:
    own = ''.join(_command(each, summary) for each, summary in _sub(parser(SUBCOMMANDS)))
    others = ''.join(_command(each, text, 3) for each, text in _sub(parser(laboratory.NAMES)))
    nodes = ''.join(
        _command(each) for each in (command_line.node_parser(), command_line.bank_parser())
    )
    return (
        '# Commands\n\n'
        'Where ROS is installed by apt, put `ros2 run mlmem_ros` before each of them. '
        'Exit status: 0 success, 1 failure, 2 a wrong command line, '
        '130 interrupted; of a node: 0 everything saved, 1 it could not start, 2 a wrong command '
        f'line, 3 it could not save.\n\n{nodes}{own}'
        f'## The laboratory\n\nCommands of the package mlmem_lab.\n\n{others}'
    )


def _sub(parser: argparse.ArgumentParser) -> Iterator[tuple[argparse.ArgumentParser, str]]:
    """Yield the sub-commands of a command: parser, summary."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            summaries = {choice.dest: choice.help or '' for choice in action._choices_actions}
            for name, each in action.choices.items():
                yield each, summaries.get(name, '')


def _command(command: argparse.ArgumentParser, summary: str = '', depth: int = 2) -> str:
    rows = [
        [f'`{_spelt(action)}`', _help(command, action)]
        for action in command._actions
        if not isinstance(
            action, argparse._HelpAction | argparse._VersionAction | argparse._SubParsersAction
        )
    ]
    about = (command.description or f'{summary}.').strip().removeprefix(f'`{command.prog}`: ')
    parts = [
        f'{"#" * depth} `{command.prog}`',
        about[:1].upper() + about[1:],
        _table(['option', 'meaning'], rows) if rows else '',
        command.epilog or '',
    ]
    below = ''.join(_command(each, text, depth + 1) for each, text in _sub(command))
    return '\n\n'.join(part for part in parts if part) + '\n\n' + below


def _spelt(action: argparse.Action) -> str:
    metavar = action.metavar if isinstance(action.metavar, str) else None
    if not action.option_strings:
        return metavar or action.dest.upper()
    takes = metavar or ('|'.join(map(str, action.choices)) if action.choices else None)
    if takes is None and action.nargs != 0:
        takes = action.dest.upper()
    return ', '.join(action.option_strings) + (f' {takes}' if takes else '')


def _help(command: argparse.ArgumentParser, action: argparse.Action) -> str:
    formatter = command._get_formatter()
    return re.sub(r'\s+', ' ', formatter._expand_help(action)) if action.help else ''


# --- files ---------------------------------------------------------------------------------


def _files() -> str:
    """Return the formats, whose keys are compared with those of an element's files."""
    element = new_element(preset('bits_1'))
    quick = quick_moves.QuickMoves({}, '')
    taken, learnt = snapshot.take(element), trims.Trims((trims.AS_SET,), '', quick)
    calibrated = dataclasses.replace(element.calibration, trims=learnt).as_dict()
    made = Specimen(element.design, offset=0.01)
    known = element_file.Element(dataclasses.replace(made, mass=2.0), made.alpha, plan=learnt)
    element.made, element.forecast = made, element.calibration
    header = _content(messages.header(element, '/mlmem', {}))
    hashed = _content(messages.state_hash(element))
    command = _content(messages.command(0, Read()))
    arguments = ['...'] if command.keys() - {'tick', 'kind'} else []
    channel = [[f'`{key}`', meaning] for key, meaning in writer.CHANNEL_METADATA.items()]
    custom = [[f'`{key}`', meaning] for key, meaning in metadata.CUSTOM_DATA.items()]
    own = [[f'`~/{name}`', meaning] for name, meaning in messages.TOPICS.items()]
    fields = [[str(base), f'`{number:#x}`'] for base, number in word_code.POLYNOMIALS.items()]
    parts = [
        '# Files',
        'The parameters of the node name its files, which are below `files.root` if that is set. '
        'JSON files are replaced atomically: after a power cut a file has its old content or the '
        'new one. Numbers are stored exactly.',
        '## Session',
        'The directory of `record.path` or `mlmem record`: a rosbag2 bag of `metadata.yaml` '
        '(version 9) and `NAME_0.mcap`, `NAME_1.mcap` ... of the profile `ros2`, with schemas in '
        f'`ros2msg`, CDR messages and zstd chunks of {mcap_file.CHUNK_SIZE // 1024} KiB with a '
        'CRC. It holds every [topic](topics.md) of the node (images and markers with '
        '`record.views`), and besides them:',
        _table(['topic', 'messages'], own),
        'All but the last are std_msgs/String with a JSON object.',
        f'### `~/{messages.HEADER}`',
        _keys(messages.KEYS[messages.HEADER], header),
        f'### `~/{messages.COMMAND}`',
        _keys(messages.KEYS[messages.COMMAND], ['tick', 'kind', *arguments]),
        f'### `~/{messages.STATE_HASH}`',
        _keys(messages.KEYS[messages.STATE_HASH], hashed),
        '### Metadata',
        _table(["key of a channel's metadata", 'meaning'], channel),
        _table(['key of `custom_data` in `metadata.yaml`', 'meaning'], custom),
        '### The last seconds',
        '`record.last_seconds` keeps them in memory, in no file. A session that begins with them, '
        'or that a failed device leaves, has the same format.',
        '## State',
        f'The file of `state.path`. {_about(state_file)}',
        _keys(state_file.KEYS, state_file.KEYS),
        'The snapshot:',
        _keys(snapshot.KEYS, taken),
        'Beside the state file `NAME.json`, `.NAME.json.lock` names the node that uses it. It '
        'means nothing once that node has ended.',
        '## Calibration',
        f'`{calibration_file.beside(Path("NAME.json"))}` beside the state file `NAME.json`. '
        f'{_about(calibration_file)}',
        _keys(calibration_file.KEYS, calibration_file.KEYS),
        'A calibration:',
        _keys(calibration.KEYS, calibrated),
        'A delay table:',
        _keys(calibration.TABLE_KEYS, calibrated['right']),
        'Trims:',
        _keys(trims.KEYS, calibrated['trims']),
        'Strokes and throws that were planned for one element:',
        _keys(quick_moves.KEYS, quick.as_dict()),
        '## Fitted element',
        f'The file of `device.specimen` and `device.twin`. {_about(element_file)}',
        _keys(element_file.KEYS, known.as_dict()),
        '## Design checks',
        f'`{design_check.FILE_NAME}`. {_about(design_check, 1)} It is a JSON object '
        f'of the latest {design_check.MOST} designs: by a hash of sources, design and settings, a '
        'list of findings (name, verdict, text).',
        '## Parameter files',
        'YAML as for any ROS node: `/**`, `ros__parameters`, and below it the '
        '[parameters](parameters.md) that differ from the preset in `design.preset`. A launch '
        'file takes one as `config:=FILE`; `mlmem design --output FILE` writes one.',
        '## Words of a bank',
        'They are not in a file: the elements hold the digits. A digit of base 2^m is an element '
        'of the field GF(2^m) with this primitive polynomial:',
        _table(['base', 'polynomial'], fields),
    ]
    return '\n\n'.join(parts) + '\n'


def _keys(meanings: Mapping[str, str], found: Iterable[str]) -> str:
    """Return a table of keys; raise `ValueError` unless they are those in a file."""
    if wrong := set(meanings) ^ set(found):
        raise ValueError(f'keys and their descriptions must agree; got {sorted(wrong)}')
    return _table(['key', 'meaning'], ([f'`{key}`', text] for key, text in meanings.items()))


def _about(module: ModuleType, paragraph: int = 0) -> str:
    """Return a paragraph of a module's docstring."""
    return (inspect.getdoc(module) or '').split('\n\n')[paragraph].replace('\n', ' ')


def _content(cdr: bytes) -> Any:
    return json.loads(jazzy.deserialize(cdr, messages.STRING).data)


# --- the line to a rig ---------------------------------------------------------------------

TYPES = {'2s': '2 bytes', 'B': 'u8', 'H': 'u16', 'I': 'u32', 'Q': 'u64', 'd': 'f64'}


def _rig() -> str:
    """Return the protocol: its layouts, and the rules in the docstring of the package."""
    _, rules = (inspect.getdoc(rig) or '').split('\n\n', 1)
    payload = [['', 'payload']]
    frame = [*_fields(frames.HEADER_FIELDS), *payload, *_fields(frames.CHECK_FIELDS)]
    kinds = [
        [f'{kind} {kind.name}', sender, '; '.join((*map(' '.join, _fields(fields)), rest))]
        for kind, (sender, fields, rest) in frames.PAYLOADS.items()
    ]
    keys = [
        [
            f'`{field.name}`',
            '' if field.default is dataclasses.MISSING else f'`{json.dumps(field.default)}`',
            hello.WANTED[field.name][0],
        ]
        for field in dataclasses.fields(hello.Hello)
    ]
    return (
        '# The line to a rig\n\n'
        'What a program around a [real element](../drivers.md) receives and sends, on TCP as on a '
        'serial line. `examples/rig` has complete rigs in Python and C99.\n\n'
        '## The address\n\n'
        '`tcp://HOST:PORT` or `serial:///dev/PORT?baud=BAUD`. Options follow a `?`: `lead`, the '
        f'seconds that set-points are sent ahead (default {driver.LEAD:g}; more than the round '
        'trip, and twice that where frames get lost), and `patience`, the seconds after which a '
        f'silent rig counts as failed (default {driver.PATIENCE:g}). Each look at the ends costs '
        'one lead.\n\n'
        '## A frame\n\n'
        f'Little-endian, without padding:\n\n{_table(["type", "content"], frame)}\n\n'
        f"The CRC-32 is zlib's. A payload has at most {frames.MOST_PAYLOAD} bytes. Bytes that are "
        'no frame are skipped, one by one.\n\n'
        f'## Payloads\n\n{_table(["kind", "from", "payload"], kinds)}\n\n'
        'Numbers have the type `numbers` of the HELLO.\n\n'
        "## The rig's HELLO\n\n"
        'A JSON object. A driver refuses an unknown key and a wrong value, and names it.\n\n'
        f'{_table(["key", "default", "must be"], keys)}\n\n'
        f'## Rules\n\n{rules}\n'
    )


def _fields(fields: frames.Fields) -> list[list[str]]:
    return [[TYPES[code], meaning] for code, meaning in fields]


# --- design checks -------------------------------------------------------------------------


def _checks() -> str:
    """Return what is checked of the paper's Case II, which passes."""
    rows = [
        [f'`{found.name}`', found.unit, found.text, found.source]
        for found in check(*preset('case_2')).findings
    ]
    return (
        '# Design checks\n\n'
        'What [`mlmem design check`](commands.md) and *configure* judge. Texts are those of '
        '`case_2`, which passes; of a design that does not they say what goes wrong and what to '
        'change.\n\n'
        f'{_table(["quantity", "unit", "what it means", "the paper"], rows)}\n'
    )


# --- presets -------------------------------------------------------------------------------

MOVES = ('throw', 'down_odd', 'down_even', 'up_even', 'up_odd')


def _presets() -> str:
    """Return the size of every preset, and the schedule of each of its moves."""
    names: dict[int, list[str]] = {}
    for name, one in presets.PRESETS.items():
        names.setdefault(id(one), []).append(name)
    sizes, schedules = [], []
    for some in names.values():
        design, settings = preset(some[0])
        named = ', '.join(f'`{name}`' for name in some)
        size = (design.levels, design.N, design.J, 1.0 / design.eta)
        sizes.append([named, *(f'{number:.6g}' for number in size)])
        write = settings.write
        schedules.append([named, 'step up', *_schedule(write), _peaks(write)])
        for name in MOVES:
            move = getattr(settings, name)
            if move.peak:
                schedules.append(['', f'`{name}`', *_schedule(move), f'{move.peak:g}'])
    head = ['preset', 'move', 'ramp', 'hold', 'ease', 'to', 'release', 'settle', 'peak strains']
    return (
        '# Presets\n\n'
        'Times are [parameters](parameters.md) of each move of a [preset](../presets.md).\n\n'
        f'{_table(["preset", "levels", "N", "J", "1/eta"], sizes)}\n\n'
        '## Schedules\n\n'
        'Times are in time units, 0.1 ms at the default scale; *to* is the share of the peak that '
        '*ease* leads to. A step up takes the sum of its times.\n\n'
        f'{_table(head, schedules)}\n'
    )


def _schedule(move: Any) -> list[str]:
    to = f'{move.ease_to:g}' if move.ease else ''
    first, last = (move.ramp, move.hold, move.ease), (move.release, move.settle)
    return [*(f'{time:g}' for time in first), to, *(f'{time:g}' for time in last)]


def _peaks(write: Any) -> str:
    return f'{write.compression:g}, {write.tension:+g}'


# --- standard problems ---------------------------------------------------------------------


def _standard_problems() -> str:
    """Return the statements in the docstrings of the problems, and our answers."""
    title, rules = _paragraphs(standard_problems)
    told = []
    for number, problem in enumerate(standard_problems.PROBLEMS, 1):
        name, statement = _paragraphs(inspect.getmodule(problem.solve))
        head = f'## {number}. `{problem.name}`: {name[0].lower()}{name[1:-1]}'
        told.append(f'{head}\n\n{statement} Step {problem.step:g}.')
    answers = [
        [f'`{one.problem}`', one.quantity, f'{one.value:.7g}', f'{one.error:.1g}']
        for one in verdict.read(verdict.OURS)
    ]
    parts = [
        '# Standard problems',
        title,
        'Solve any of them with your code, write a CSV file with the columns `problem, quantity, '
        'value`, and `mlmem standard_problems FILE` judges it: right is within '
        f'{100.0 * verdict.CLOSE:g} % of our answer, or within ten times its error.',
        rules,
        *told,
        '## Our answers',
        _table(['problem', 'quantity', 'value', 'error'], answers),
    ]
    return '\n\n'.join(parts) + '\n'


def _paragraphs(module: ModuleType | None) -> tuple[str, str]:
    """Return the first line of a docstring, and what follows it."""
    first, _, rest = (inspect.getdoc(module) or '').partition('\n\n')
    return first, rest


if __name__ == '__main__':
    FOLDER.mkdir(exist_ok=True)
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding='utf-8')
        print(f'docs/reference/{name}')
    POLICY.write_text(policy(), encoding='utf-8')
