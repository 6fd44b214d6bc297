# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands that make one request to a running node and print its answer."""

from __future__ import annotations

import argparse
import dataclasses
import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from mlmem.procedure_table import PROCEDURES, Procedure, describe_content

from .command import JSON_OPTION, NODE_OPTION, Command, Option, declare_command, declare_option
from .output import print_failure, print_json

if TYPE_CHECKING:
    from mlmem_ros.contract.answers import Answer, Calibrated, Decoded, SelfTested
    from mlmem_ros.ros.client.client import MemoryClient
    from mlmem_ros.ros.client.reply import Reply

SomeAnswer = TypeVar('SomeAnswer', bound='Answer')


def _build_request_command(
    summary: str,
    ask: Callable[[MemoryClient, argparse.Namespace], Reply[SomeAnswer]],
    describe: Callable[[SomeAnswer], str],
    *options: Option,
    more: str = '',
) -> Command:
    """Return the command of a request.

    Its exit status is 0 on success, 1 on failure, on a failed self-test or if no node answers.
    """

    def run_request(arguments: argparse.Namespace) -> int:
        from mlmem_ros.contract.answers import RequestError, RequestFailed
        from mlmem_ros.ros.client.client import standalone

        try:
            with standalone(arguments.node) as client:
                client.ready(arguments.wait).wait()
                answer = ask(client, arguments).wait()
                if (count := client.node_count()) > 1:
                    warning = (
                        f'{count} nodes of this name are on the graph, or one was killed in the '
                        'last 20 s: either may have answered; rename one with "-r __node:=NAME" '
                        'or "-r __ns:=/NAMESPACE"'
                    )
                    print_failure(arguments.command, warning, 0)
        except (RequestError, ValueError) as error:
            if arguments.json and isinstance(error, RequestFailed):
                print_json(error.answer)
            return print_failure(arguments.command, error, 1)
        if arguments.json:
            print_json(_as_dict(answer))
        else:
            print(describe(answer))
        return 0 if getattr(answer, 'passed', True) else 1

    wait = declare_option(
        '--wait', type=float, default=5.0, metavar='S', help='longest wait for the node'
    )
    text = f'{summary[0].upper()}{summary[1:]}.\n\n{more}'.rstrip()
    return declare_command(summary, *options, NODE_OPTION, wait, JSON_OPTION, text=text)(
        run_request
    )


def _as_dict(answer: Answer) -> dict[str, Any]:
    """Return an answer as plain values: the parsed ones, and everything from the node."""
    fields = {field.name: getattr(answer, field.name) for field in dataclasses.fields(answer)}
    said = fields.pop('details')
    if 'checks' in fields:
        return {**fields, 'measured': said}
    return {name: fields.get(name, value) for name, value in said.items()}


def _format_decoded(answer: Decoded) -> str:
    """Return the content, and whatever else is known of its reading, in one line."""
    from mlmem_ros.contract.answers import Decoded, Done, describe_fields

    text = describe_content('level' if answer.word is None else 'word', answer.content)
    if answer.code:
        text += f' (code {answer.code})'
    for name, row in describe_fields(Decoded):
        value = getattr(answer, name)
        if name in ('level', 'word', 'code', *Done.__annotations__) or value in (None, ''):
            continue
        label = (row.short or name).replace('_', ' ')
        text += f', {label} {value:.4g}' if isinstance(value, float) else f', {label} {value}'
    return text


def _format_calibrated(answer: Calibrated) -> str:
    """Return the content as a line, and measured delays as a table: levels by ends."""
    if answer.delays is None:
        return _format_decoded(answer)
    columns = zip(*answer.delays.values(), strict=True)
    rows = [
        f'{level:5}' + ''.join(f'{delay:10.2f}' for delay in delays)
        for level, delays in enumerate(columns)
    ]
    headings = 'level' + ''.join(f'{end:>10}' for end in answer.delays)
    return '\n'.join([_format_decoded(answer), headings, *rows])


def _format_tested(answer: SelfTested) -> str:
    """Return the result of every check, one line each."""
    width = max(map(len, answer.checks))
    return '\n'.join(
        f'{"FAILED" if name in answer.failed else "ok":6}  {name:{width}}  {found}'
        for name, found in answer.checks.items()
    )


def _format_found(answer: Decoded) -> str:
    """Return a decoded content, and whatever else was measured, one line each."""
    from mlmem_ros.contract.answers import Decoded

    more = [name for name in type(answer).__annotations__ if name not in Decoded.__annotations__]
    others = {name: getattr(answer, name) for name in more}
    lines = (f'{name} {value}' for name, value in others.items() if value not in (None, ''))
    return '\n'.join([_format_decoded(answer), *lines])


def _format_answer(name: str, answer: Any) -> str:
    """Return the answer to a procedure in words."""
    match name:
        case 'abort':
            return f'stopped; the strain is at zero after {answer.ticks} ticks'
        case 'calibrate':
            return _format_calibrated(answer)
        case 'kick':
            return f'kicked in {answer.ticks} ticks; what rests now is not known until a read'
        case 'self_test':
            return _format_tested(answer)
        case 'write':
            return f'wrote {_format_decoded(answer)}'
        case _:
            return _format_found(answer)


def parse_integer(text: str) -> int:
    """Return a number in decimal, or in hexadecimal as 0xa7."""
    try:
        return int(text, 0)
    except ValueError:
        raise argparse.ArgumentTypeError(f'invalid int value: {text!r}') from None


def _parse_seconds(text: str) -> float:
    try:
        if float(text) > 0.0:
            return float(text)
    except ValueError:
        pass
    raise argparse.ArgumentTypeError(f'must be a time above 0 s; got {text!r}')


def _build_procedure_command(name: str, row: Procedure) -> Command:
    """Return the command of a procedure: what it must be given is positional."""
    # work that takes the longer, the longer the element is: the node's end is noticed anyway
    is_unbounded = name in ('calibrate', 'self_test', 'survey', 'write', 'erase')
    more = {
        'abort': 'The answer comes when the strain is zero. The stopped request fails.',
        'calibrate': 'It takes as long as some ten writes.',
        'self_test': 'It takes as long as some ten writes. Exit status 0: every check passed.',
    }
    parsers = {'float': float, 'int': parse_integer, 'str': str}

    def send_procedure(client: MemoryClient, given: argparse.Namespace) -> Reply[Any]:
        wanted = {argument: getattr(given, argument) for argument, *_ in row.arguments}
        if (timeout := given.timeout or (math.inf if is_unbounded else None)) is not None:
            wanted['timeout'] = timeout
        own = getattr(client, name, None)  # with the time-out that suits it
        return own(**wanted) if own is not None else client.procedure(name, **wanted)

    options = [
        declare_option(argument, type=parsers[kind], help=description.text)
        if argument in row.required_arguments
        else declare_option(
            f'--{argument}',
            type=parsers[kind],
            default=default,
            choices=description.choices or None,
            metavar=argument.upper(),
            help=description.text,
        )
        for argument, kind, default, description in row.arguments
    ]
    options.append(
        declare_option(
            '--timeout',
            type=_parse_seconds,
            metavar='S',
            help='longest wait for the answer; by default long enough for the procedure',
        )
    )
    return _build_request_command(
        row.meaning,
        send_procedure,
        partial(_format_answer, name),
        *options,
        more=more.get(name, ''),
    )


def build_command(name: str) -> Command:
    """Return the command of a procedure, or `record`."""
    if name in PROCEDURES:
        return _build_procedure_command(name, PROCEDURES[name])
    return _build_request_command(
        'make a running node start or end recording a session',
        # a node that only begins, and compiles, answers late
        lambda client, given: client.record(not given.stop, given.path or '', math.inf),
        lambda answer: f'{"recording into" if answer.recording else "recorded"} {answer.path}',
        declare_option('path', nargs='?', help="path of the bag, below the node's `files.root`"),
        declare_option('--stop', action='store_true', help='end the recording'),
        more="""\
If the path exists, the time is added to its name. Without a path, the node takes its
`record.path`.""",
    )
