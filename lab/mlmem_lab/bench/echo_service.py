# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node that refuses every `~/step` at once, and receives `~/disturbance`: what a request and an
IMU take of the middleware alone.

It runs in the memory node's executor, and ends with its standard input.
"""

from __future__ import annotations

import sys
import threading

import rclpy
from sensor_msgs.msg import Imu
from std_srvs.srv import Trigger

from mlmem_ros.ros.middleware import create_events_executor


def main() -> None:
    """Serve until nobody listens."""
    rclpy.init()
    node = rclpy.create_node('echo')

    def refuse_request(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = '{"error": "refused"}'
        return response

    node.create_service(Trigger, '~/step', refuse_request)
    node.create_subscription(Imu, '~/disturbance', lambda cdr: None, 10, raw=True)
    executor = create_events_executor(None)
    executor.add_node(node)
    ended = threading.Event()

    def serve_requests() -> None:
        sys.stdin.read()
        ended.set()

    threading.Thread(target=serve_requests, daemon=True).start()
    print('{"ready": 0.0}', flush=True)
    while not ended.is_set():
        executor.spin_once(timeout_sec=0.2)


if __name__ == '__main__':
    main()
