# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Playing the recorded commands of a session into a running node, at the recorded pace."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import Imu
from std_msgs.msg import Empty, Float64, Int16, UInt8

from ..bag.session_data import SessionData
from ..device import (
    Abort,
    Calibrate,
    Command,
    Disturb,
    Erase,
    FollowTrajectory,
    Read,
    SelfTest,
    SetFaults,
    SetStrain,
    Settings,
    Write,
)
from ..device.settings import ScaleSettings
from .client import MemoryClient
from .qos import LATCHED, RELIABLE
from .reply import Reply
from .standalone import POLL, standalone, wait_until

Progress = Callable[[int, int], None]

ANY_TIME = (Abort, Disturb, SetFaults)
"""Commands that do not wait for a procedure to end."""

NO_END = (SetStrain, FollowTrajectory, Disturb, SetFaults)
"""Commands that begin no procedure."""

PATIENCE = 120.0
"""Longest wait in seconds for a procedure to end, on a machine slower than the recorder's."""


def play(session: SessionData, name: str, progress: Progress) -> list[int]:
    """Send the commands of a session to a node and listen to the levels it decodes.

    Args:
        session: The recorded session; its stamped commands are sent, or where there are none
            (another recorder's bag) its command messages.
        name: Name of the node.
        progress: Called with milliseconds done and to do.

    Returns:
        The levels heard, in order.

    Raises:
        NoAnswer: There is no such node, or the levels did not come.
    """
    schedule = _schedule(session)
    heard: list[int] = []
    ended: list[DiagnosticStatus] = []
    begun = 0

    def all_ended() -> None:
        wait_until(lambda: len(ended) >= begun, f'the end of a procedure of {name}', PATIENCE)

    with standalone(name) as client:
        client.ready().wait()
        settings = session.settings if session.header else Settings()
        send = _sender(client, settings.scale)
        client.node.create_subscription(
            Int16, f'{client.name}/level', lambda message: heard.append(message.data), LATCHED
        )
        client.node.create_subscription(
            DiagnosticStatus, f'{client.name}/outcome', ended.append, LATCHED
        )
        time.sleep(1.0)  # what is latched from before is none of ours
        heard.clear()
        ended.clear()
        start = time.monotonic()
        for due, command in schedule:
            while (left := due - (time.monotonic() - start)) > 0.0:
                progress(round(1e3 * (due - left)), round(1e3 * schedule[-1][0]))
                time.sleep(min(left, POLL))
            if not isinstance(command, ANY_TIME):  # the node may be slower than the recorded one
                all_ended()
            send(command)
            begun += not isinstance(command, NO_END)
        all_ended()
        time.sleep(0.2)  # the last level may come behind its outcome
    return heard


def _schedule(session: SessionData) -> list[tuple[float, Command]]:
    if not session.stamped:
        return session.commands
    settings = session.settings
    tick_seconds = settings.time.tick * settings.scale.time
    first = session.stamped[0][0]
    return [((tick - first) * tick_seconds, command) for tick, command in session.stamped]


def _sender(client: MemoryClient, scale: ScaleSettings) -> Callable[[Command], None]:
    node, name = client.node, client.name
    publishers: dict[type[Any], Any] = {
        SetStrain: node.create_publisher(Float64, f'{name}/strain', RELIABLE),
        Read: node.create_publisher(Empty, f'{name}/probe', RELIABLE),
        Write: node.create_publisher(UInt8, f'{name}/write_level', RELIABLE),
        Disturb: node.create_publisher(Imu, f'{name}/disturbance', RELIABLE),
    }
    requests: dict[type[Any], Callable[[], Any]] = {
        Erase: client.erase,
        Calibrate: client.calibrate,
        SelfTest: client.self_test,
        Abort: client.abort,
    }
    wait_until(
        lambda: all(publisher.get_subscription_count() for publisher in publishers.values()),
        f'a subscriber of the topics of {name}',
    )

    def send(command: Command) -> None:
        match command:
            case SetStrain(strain):
                publishers[SetStrain].publish(Float64(data=strain))
            case FollowTrajectory():
                client.follow(command.times, command.strains, command.rates)
            case Read():
                publishers[Read].publish(Empty())
            case Write(level):
                publishers[Write].publish(UInt8(data=level))
            case Disturb(acceleration):
                message = Imu()
                message.linear_acceleration.x = acceleration * scale.acceleration
                publishers[Disturb].publish(message)
            case SetFaults(faults):
                values = {f'faults.{name}': value for name, value in asdict(faults).items()}
                client.set_parameters(values).add_done_callback(Reply.exception)
            case _:
                reply = requests[type(command)]()
                reply.add_done_callback(Reply.exception)  # ~/outcome tells how it ends

    return send
