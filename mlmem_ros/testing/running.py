# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A memory node that runs for a test, in its process or in one of its own, in a ROS graph of their
own; and its faults.
"""

from __future__ import annotations

import atexit
import functools
import os
import shutil
import socket
import subprocess
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from rclpy.context import Context
from rclpy.utilities import try_shutdown

from ..contract.answers import RequestRefused
from ..host import REFUSALS
from ..ros.main import parse_node_arguments
from ..ros.node.node import MemoryNode
from ..ros.node.run import NodeOptions, end_nodes, spin_nodes, start_nodes
from ..ros.node_process import (
    ParameterValues,
    build_node_arguments,
    find_profile_variable,
    run_node_process,
)

if TYPE_CHECKING:
    from typing_extensions import Self

    from ..ros.client import MemoryClient


@functools.cache
def isolate() -> int:
    """Keep this process and all that it starts out of other ROS graphs; return the ROS domain.

    Call it in a `conftest.py`, before anything initialises rclpy. Each parallel run on a machine
    gets a domain of its own.

    Raises:
        RuntimeError: No domain is left.
    """
    home = Path(tempfile.mkdtemp(prefix='mlmem-ros-'))
    atexit.register(shutil.rmtree, home, ignore_errors=True)
    domain = _claim_domain()
    os.environ.update(
        ROS_DOMAIN_ID=str(domain),
        ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST',
        ROS_LOG_DIR=str(home / 'log'),
        RMW_IMPLEMENTATION='rmw_fastrtps_cpp',
    )
    os.environ.setdefault('ROS_PYTHON_CHECK_FIELDS', '1')  # empty: as on a robot
    profile = Path(__file__).with_name('fast_discovery.xml')
    os.environ[find_profile_variable(os.environ)] = str(profile)
    return domain


def _claim_domain() -> int:
    for offset in range(100):
        domain = 1 + (os.getpid() + offset) % 100
        if is_domain_used(domain):
            continue
        claim = socket.socket(socket.AF_UNIX)
        try:
            claim.bind(f'\0mlmem-ros-domain-{domain}')  # no file: other users have theirs
        except OSError:
            claim.close()
        else:
            claim.detach()  # so that it stays until this process ends
            return domain
    raise RuntimeError('all ROS domains from 1 to 100 are in use')


def is_domain_used(domain: int) -> bool:
    """Return whether somebody on this machine, such as a robot or a daemon, is in a ROS domain.

    A participant listens at the first free of the domain's discovery ports (RTPS 2.5, 9.6.2.3).
    """
    for participant in range(10):  # the first discovery ports of the domain
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('', 7410 + 250 * domain + 2 * participant))
            except OSError:
                return True
    return False


class NodeClient:
    """Reaches a memory node that runs, until the end of its context.

    Attributes:
        element: Full name of the node.
    """

    def __init__(self, element: str) -> None:
        self.element = element
        self.ends = ExitStack()

    @cached_property
    def memory(self) -> MemoryClient:
        """A client of it, created on first use."""
        from ..ros.client.client import standalone

        start_timeout = 60.0  # seconds, on a busy machine
        return self.ends.enter_context(standalone(self.element, start_timeout))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.ends.close()


class NodeApart(NodeClient):
    """A running process of `memory_node`."""

    def __init__(self, element: str, arguments: Sequence[str]) -> None:
        super().__init__(element)
        folder = self.ends.enter_context(tempfile.TemporaryDirectory(prefix='memory-node-'))
        self._output = Path(folder, 'output.txt')
        with self._output.open('wb') as output:
            self._process = self.ends.enter_context(
                run_node_process(arguments, stdout=output, stderr=subprocess.STDOUT)
            )

    def step(self, ticks: int) -> int:
        """Run ticks while time is paused; return the ticks since its start."""
        return [self.memory.step().wait().tick for _ in range(ticks)][-1]

    @property
    def output(self) -> str:
        """Its output, on both streams."""
        return self._output.read_text(encoding='utf-8')

    @property
    def running(self) -> bool:
        """Whether it is still running."""
        return self._process.poll() is None

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    def signal(self, number: int) -> None:
        """Send it a signal."""
        self._process.send_signal(number)

    def terminate(self) -> None:
        """Ask it to end, if it is still running."""
        self._process.terminate()

    def exit_status(self, within: float = 60.0) -> int:
        """Wait for its end; negative: the signal that killed it."""
        try:
            return self._process.wait(within)
        except subprocess.TimeoutExpired:
            raise TimeoutError(f'{self.element} did not end within {within:g} s') from None


class NodeHere(NodeClient):
    """A node in this process, or several, their executor and its thread.

    Attributes:
        nodes: All of them.
    """

    def __init__(
        self,
        element: str,
        arguments: Sequence[str],
        elements: Sequence[NodeOptions] = ({},),
    ) -> None:
        """Start the nodes, the first named `element`; raises what keeps them from starting."""
        super().__init__(element)
        self._said: list[str] = []
        self._stop: list[None] = []
        self._status: int | None = None
        said = self._said

        class Overheard(MemoryNode):
            """A node that keeps its log."""

            def write_line(self, severity: str, text: str) -> None:
                said.append(f'[{severity}] [{self.get_logger().name}]: {text}\n')
                super().write_line(severity, text)

        context = Context()
        try:
            self.nodes, self._executor = start_nodes(
                parse_node_arguments(arguments), context, Overheard, elements
            )
        except BaseException:
            try_shutdown(context=context)
            raise
        self._thread = threading.Thread(target=self._run, name='mlmem-node', daemon=True)
        self._thread.start()
        self.ends.callback(self.exit_status)
        self.ends.callback(self.terminate)

    def _run(self) -> None:
        spin_nodes(self._executor, self._stop)
        self._status = end_nodes(self.nodes, self._executor)

    @property
    def node(self) -> MemoryNode:
        """The first node."""
        return self.nodes[0]

    def step(self, ticks: int) -> int:
        """Run ticks while time is paused; return the ticks since its start."""
        try:
            return self.node.host.step(ticks).answer.result(60.0)
        except REFUSALS as refusal:
            raise RequestRefused({'error': str(refusal)}) from refusal

    @property
    def output(self) -> str:
        """Its log, in console format."""
        return ''.join(self._said)

    @property
    def running(self) -> bool:
        """Whether it is still running."""
        return self._thread.is_alive()

    def terminate(self) -> None:
        """Ask it to end, if it is still running."""
        if not self._stop:
            self._stop.append(None)
            self._executor.interrupt()

    def exit_status(self, within: float = 60.0) -> int:
        """Wait for its end.

        Raises:
            TimeoutError: It does not end in time.
        """
        self._thread.join(within)
        if self._status is None:
            raise TimeoutError(f'{self.element} did not end within {within:g} s')
        return self._status


RunningNode = NodeHere | NodeApart
"""A memory node that runs, in this process or in its own: `memory` is a client of it."""


@contextmanager
def faults(node: RunningNode, **given: bool | int | float) -> Iterator[None]:
    """Set faults of an element, named like the parameters `faults.*`, and restore them at the end,
    even after an exception.

    ::

        with faults(node, actuator_stuck=True), pytest.raises(RequestFailed):
            node.memory.write(3).wait()

    Commands sent in the block meet the faults; those sent afterwards do not.

    Raises:
        RequestRefused: There is no such fault, or the element cannot have it.
    """
    named = {f'faults.{name}': value for name, value in given.items()}
    before = node.memory.parameters(*named).wait()
    try:
        node.memory.set_parameters(named).wait()
        yield
    finally:
        if node.running:
            node.memory.set_parameters(before).wait()


@contextmanager
def memory_node(
    parameters: ParameterValues | None = None,
    *,
    name: str = 'mlmem',
    namespace: str = '',
    file: str | PathLike[str] | None = None,
    options: Sequence[str] = (),
    apart: bool = False,
) -> Iterator[RunningNode]:
    """Run a memory node until the end of the context.

    ::

        with memory_node({'time.speed': 10.0}) as node:
            assert node.memory.write(5).wait().level == 5

    It joins the ROS graph like any node, in the environment's ROS_DOMAIN_ID: set one that no robot
    uses. In the test's own process it starts in less than a second.

    Args:
        parameters: Parameters by name.
        name: Name of the node.
        namespace: Its namespace.
        file: A parameter file.
        options: Further command line arguments, plain options first.
        apart: Run it in a process of its own, which can take signals and crash; that takes some
            seconds to start.

    Yields:
        The node; one apart also has `signal(number)`.

    Raises:
        Exception: Whatever keeps the node from starting. One apart raises nothing: see its output
            and exit status.
    """
    element = f'{namespace.rstrip("/")}/{name}'
    command = build_node_arguments(element, parameters, file)
    if apart:
        with NodeApart(element, [*options, *command]) as node:
            yield node
    else:
        with NodeHere(element, ['memory_node', *options, *command]) as node:
            yield node
