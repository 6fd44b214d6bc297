# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The executable `memory_monitor`: compares the reads of a memory node with the forecasts of a
twin, and reports what has changed on `/diagnostics`.
"""

from __future__ import annotations

import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node

from mlmem import ErrorCode, SettingsError, element_file
from mlmem.element_file import read_matching_element
from mlmem.instrument.drivers import SIMULATION_NAME
from mlmem_ros.contract.answers import RequestError
from mlmem_ros.contract.streams import STREAMS, decode_read_shot
from mlmem_ros.contract.topics import DIAGNOSTICS_TOPIC, OK, WARN, Qos, Status, parse_status
from mlmem_ros.host.settings import DESCRIPTION
from mlmem_ros.host.worker import ThrottledLog
from mlmem_ros.ros.client.client import MemoryClient
from mlmem_ros.ros.middleware import write_log_line
from mlmem_ros.ros.node.diagnostics import REPORT_PERIOD_S
from mlmem_ros.ros.node.topics import build_status

from .watching import ResidualMonitor


class MonitorNode:
    """Listens to `~/read_waveform` and `~/outcome` of a memory node that holds one wall.

    Attributes:
        node: The node by which it listens and reports.
    """

    def __init__(self, node: Node) -> None:
        """Ask the memory node for its element, and listen.

        Raises:
            RequestError: The node does not answer.
            SettingsError: The twin is not one of its element, or no read of this can be compared.
            ElementFileError: The file of the twin cannot be read.
        """
        self.node = node
        twin, name = (
            node.declare_parameter(
                name, default, ParameterDescriptor(description=description, read_only=True)
            ).value
            for name, default, description in (
                ('twin', '', 'file of the fitted element that the node drives'),
                ('node', 'mlmem', 'name of the memory node'),
            )
        )
        memory = MemoryClient(node, name, patience=60.0, actions=False)
        self._monitored = memory.name
        self._monitor = _build_monitor(memory, Path(twin))
        self._log = ThrottledLog(partial(write_log_line, node.get_logger().name))
        self._publisher = node.create_publisher(
            DiagnosticArray, DIAGNOSTICS_TOPIC.name, DIAGNOSTICS_TOPIC.qos.profile
        )
        # a comparison takes seconds
        for stream, take in (('read_waveform', self._take_shot), ('outcome', self._take_outcome)):
            node.create_subscription(
                STREAMS[stream].kind,
                f'{self._monitored}/{stream}',
                take,
                Qos.RELIABLE.profile,
                callback_group=MutuallyExclusiveCallbackGroup(),
            )
        node.create_timer(REPORT_PERIOD_S, self._publish_health)

    def _take_shot(self, message: Any) -> None:
        with self._log.guard_errors('read_waveform'):
            self._monitor.take_shot(decode_read_shot(np.asarray(message.data)))

    def _take_outcome(self, message: Any) -> None:
        time.sleep(0.2)  # the waveforms of its read come on another topic
        before = self._monitor.text
        with self._log.guard_errors('outcome'):
            self._monitor.end_procedure(parse_status(message).values.get('procedure', ''))
        if self._monitor.text and not before:
            self._log.warning(f'twin: {self._monitor.text}')

    def _publish_health(self) -> None:
        message = DiagnosticArray()
        message.header.stamp = self.node.get_clock().now().to_msg()
        health = report_twin(self._monitor)
        message.status.append(build_status(health, self._monitored, 'twin'))
        self._publisher.publish(message)


def report_twin(monitor: ResidualMonitor) -> Status:
    """Report the residual of reads against a twin's forecast, in cells; warn of what changed.

    Alpha and its deviation are over the design's.
    """
    made, nominal = monitor.twin.specimen, monitor.twin.design.alpha
    values: dict[str, Any] = {
        'compared': monitor.compared, 'skipped': monitor.skipped,
        'alpha': (made.alpha / nominal).tolist(),
        'alpha_std': (monitor.twin.alpha_std / nominal).tolist(),
    }  # fmt: skip
    if (last := monitor.last) is not None:
        left, right = map(float, last.residual)
        values |= {'chi2': last.chi2, 'residual_left': left, 'residual_right': right}
        if (change := last.change) is not None:
            values |= {
                'changed': change.name, 'site': change.site, 'amount': change.amount,
                'deviation': change.deviation,
            }  # fmt: skip
    if monitor.text:
        return Status(WARN, monitor.text, values)
    return Status(OK, 'as forecast' if monitor.compared else 'no read compared yet', values)


def _build_monitor(memory: MemoryClient, twin: Path) -> ResidualMonitor:
    """Return the monitor of the element behind a memory node; raises as `MonitorNode`."""
    parameters = memory.parameters(DESCRIPTION, 'device.driver', timeout=60.0).wait()
    element = element_file.parse(parameters[DESCRIPTION], DESCRIPTION)
    design, settings = element.design, element.settings
    # the derivatives by all cells take memory and time
    if settings.compares_waveforms or design.N > 1000:
        expected = (
            'one that holds one wall and reads it by delays, in at most 1000 cells; others '
            'compare every read with forecasts by themselves'
        )
        raise SettingsError(ErrorCode.UNSUPPORTED, 'element', element, expected)
    simulated = parameters['device.driver'] == SIMULATION_NAME
    return ResidualMonitor(read_matching_element(twin, design), simulated)


def main() -> int:
    """Monitor a memory node until SIGINT or SIGTERM; return the exit status."""
    rclpy.init()
    executor = MultiThreadedExecutor(3)
    try:
        executor.add_node(MonitorNode(Node('memory_monitor')).node)
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        return 0
    except (RequestError, SettingsError, element_file.ElementFileError) as error:
        print(f'memory_monitor: {error}', file=sys.stderr)
        return 1
    finally:
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
