# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reports that the kernels are being compiled, while the node can report nothing else."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rclpy.node import Node

from ...physics import INTEGRATORS, Design, kernel_in_cache

REMINDER = 1.0
"""Seconds between two reports: a subscriber may have missed the first."""


@contextmanager
def telling_compilation(
    node: Node, design: Design, integrator: str, report: Callable[[str], None]
) -> Iterator[None]:
    """Log it if the body must compile the kernels of a design and a method first.

    Then also call `report` with the text, at once and repeatedly, from another thread.
    """
    if kernel_in_cache(design, INTEGRATORS[integrator]):
        yield
        return
    text = f'compiling the kernels of the {design.substrate} substrate ({integrator})'
    node.get_logger().info(f'{text} (once; it takes some seconds)')
    begun, over = time.monotonic(), threading.Event()

    def remind() -> None:
        report(text)
        while not over.wait(REMINDER):
            report(text)

    reminder = threading.Thread(target=remind, name='mlmem-compiling', daemon=True)
    reminder.start()
    try:
        yield
    finally:
        over.set()
        reminder.join()
    node.get_logger().info(f'compiled in {time.monotonic() - begun:.1f} s, and cached')
