# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Playing the recorded commands of a session into a running node, at the recorded pace."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus

from mlmem_ros.contract import calls, topics
from mlmem_ros.contract.calls import RequestFailed, RequestRefused
from mlmem_ros.contract.commands import arguments_of, name_of
from mlmem_ros.device import (
    BLANK,
    Abort,
    Command,
    Disturb,
    FollowTrajectory,
    Inject,
    Read,
    SetFaults,
    SetMethod,
    SetStrain,
    describe_level,
)
from mlmem_ros.device.instrument import Units
from mlmem_ros.law_file import curve_of
from mlmem_ros.ros.client.client import POLL, MemoryClient, standalone, wait_until
from mlmem_ros.ros.middleware import LATCHED, RELIABLE
from mlmem_ros.session.data import SessionData
from mlmem_ros.session.replay import element_of
from mlmem_ros.session.report import agreeing, ending, remains

Progress = Callable[[int, int], None]

ANY_TIME = (Abort, Disturb, Inject, SetFaults, SetMethod)
"""Commands that do not wait for a procedure to end."""

NO_END = (SetStrain, FollowTrajectory, Disturb, Inject, SetFaults, SetMethod)
"""Commands that do not start a procedure."""

METHOD = 'write.method'
"""The parameter that says how a level is written."""

PATIENCE = 120.0
"""Longest wait in seconds for a procedure to end, on a machine slower than the recording one."""


@dataclass(frozen=True)
class Played:
    """How a session went in a running node.

    Attributes:
        ended: How the node's procedures ended; see `ending`.
        recorded: How they ended when they were recorded.
        hints: What differed before the first command, one line each.
    """

    ended: list[str]
    recorded: list[str]
    lost: list[str]
    hints: list[str]

    @property
    def passed(self) -> bool:
        """Whether every recorded procedure ended the same way."""
        return bool(self.recorded) and agreeing(self.recorded, self.ended) == len(self.recorded)

    @property
    def whole(self) -> bool:
        """Whether nothing is missing from the recording."""
        return not self.lost

    @property
    def verdict(self) -> str:
        """The verdict in one sentence, with any reason against it in capitals."""
        if not self.recorded:
            return 'NOTHING TO COMPARE: the bag has no finished procedure on ~/outcome'
        if agreeing(self.recorded, self.ended) < len(self.recorded):
            why = '; see what differed beforehand' if self.hints else ''
            return f'THE LEVELS DIFFER from those that were recorded{why}'
        return f'{remains(self.lost)}every procedure ended as it was recorded'

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values, for programs."""
        found = {'verdict': self.verdict, 'passed': self.passed, 'whole': self.whole}
        return found | asdict(self)


def play(session: SessionData, name: str, progress: Progress) -> Played:
    """Send the commands of a session to a node and listen to how its procedures end.

    The node is read first, since the session depends on its content.

    Args:
        progress: Called with milliseconds done and to do.

    Returns:
        How procedures ended in the node and in the recording.

    Raises:
        RequestError: There is no such node, it is busy, or a procedure did not end.
    """
    schedule = _schedule(session)
    ended: list[str] = []
    begun = 0

    def listen(status: DiagnosticStatus) -> None:
        ended.append(ending(calls.values_of(status)))

    def all_ended() -> None:
        wait_until(lambda: len(ended) >= begun, f'the end of a procedure of {name}', PATIENCE)

    with standalone(name) as client:
        client.ready().wait()
        header = session.header
        send = _sender(client, Units(header.design, header.settings.scale) if header else Units())
        hints = [*_otherwise(session, client), *_other_content(session, client)]
        client.node.create_subscription(
            DiagnosticStatus, f'{client.name}/outcome', listen, LATCHED
        )
        wait_until(lambda: ended, f'the outcome of a read of {name}')  # of ours, and latched
        ended.clear()
        start = time.monotonic()
        for due, command in schedule:
            while (remaining := due - (time.monotonic() - start)) > 0.0:
                progress(round(1e3 * (due - remaining)), round(1e3 * schedule[-1][0]))
                time.sleep(min(remaining, POLL))
            if not isinstance(command, ANY_TIME):  # the node may be slower than the recorded one
                all_ended()
            send(command)
            begun += not isinstance(command, NO_END)
        all_ended()
    recorded = [ending(values) for _, values in session.outcomes]
    return Played(ended, recorded, session.lost, hints)


def _otherwise(session: SessionData, client: MemoryClient) -> Iterator[str]:
    """Yield the node's settings that differ from a session's."""
    if session.header is None:
        return
    groups = {'design': session.design.as_dict(), **session.settings.as_dict()}
    groups['design'].pop('law', None)
    recorded = {
        f'{group}.{name}': value
        for group, values in groups.items()
        for name, value in values.items()
    }
    try:
        present = client.parameters(*recorded, 'design.law').wait()
    except RequestRefused:  # a node of another version, whose parameters have other names
        return
    scale, text = session.settings.scale, present['design.law']
    if session.design.law != (curve_of(text, scale.length, scale.stiffness) if text else None):
        yield f'design.law of {client.name} is not that of the session'
    for name, value in recorded.items():
        if present[name] != value:
            yield f'{name} of {client.name} is {present[name]}; when it was recorded, {value}'


def _other_content(session: SessionData, client: MemoryClient) -> Iterator[str]:
    """Yield what the node holds, if the session began with another content.

    With what a session of a real element began is unknown.
    """
    if session.header is not None and not session.header.simulated:
        return
    try:
        present = describe_level(client.read().wait().level)
    except RequestRefused:
        raise
    except RequestFailed as error:  # the echo could not be decoded
        present = str(error)
    recorded = _content_before(session)
    if present != recorded:
        yield (
            f'{client.name} held another content: {present}; in the recording, {recorded}. Set it '
            'first, e.g. with mlmem erase or mlmem write'
        )


def _content_before(session: SessionData) -> str:
    """Return what a read shows of the state with which a session began."""
    if session.header is None:
        return describe_level(BLANK)  # as `replay_commands` does
    element = element_of(session)
    outcome = element.perform(Read())
    return outcome.error or describe_level(outcome.reading.level if outcome.reading else BLANK)


def _schedule(session: SessionData) -> list[tuple[float, Command]]:
    if not session.stamped:
        return session.commands
    tick_seconds, first = session.settings.tick_seconds, session.stamped[0][0]
    return [((tick - first) * tick_seconds, command) for tick, command in session.stamped]


def _sender(client: MemoryClient, units: Units) -> Callable[[Command], None]:
    publishers = {
        topic: client.node.create_publisher(topic.kind, f'{client.name}/{topic.name}', RELIABLE)
        for topic in (topics.STRAIN, topics.DISTURBANCE)
    }
    wait_until(
        lambda: all(publisher.get_subscription_count() for publisher in publishers.values()),
        f'a subscriber of the topics of {client.name}',
    )

    def send(command: Command) -> None:  # ~/outcome reports how it ends
        if isinstance(command, SetStrain | Disturb):
            topic, message = published(command, units)
            publishers[topic].publish(message)
            return
        if isinstance(command, SetFaults):
            faults = asdict(command.faults)
            client.set_parameters({f'faults.{name}': faults[name] for name in faults})
        elif isinstance(command, SetMethod):
            client.set_parameters({METHOD: command.method})
        else:
            client.request(name_of(command), **arguments_of(command))

    return send


def published(command: SetStrain | Disturb, units: Units) -> tuple[topics.Topic, Any]:
    """Return the topic and the message for a command that is not a request."""
    if isinstance(command, SetStrain):
        return topics.STRAIN, topics.STRAIN.kind(data=command.strain)
    message = topics.DISTURBANCE.kind()
    message.linear_acceleration.x = command.acceleration * units.acceleration
    return topics.DISTURBANCE, message
