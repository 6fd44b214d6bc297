# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An open page of `mlmem view`, as a node sees it: its server, and a client that takes pictures.

No browser draws them, because on a few cores it would disturb the measurement.
"""

from __future__ import annotations

import asyncio
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress


@contextmanager
def open_page(node: str) -> Iterator[None]:
    """Keep a page open."""
    command = [sys.executable, '-m', 'mlmem_tools.cli.main', 'view', '--port', '0', '--node', node]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    address = process.stdout.readline().split()[-1].rstrip('/')
    reader = threading.Thread(target=lambda: asyncio.run(_take(address)), daemon=True)
    reader.start()
    try:
        yield
    finally:
        process.terminate()
        process.wait(10.0)
        reader.join(10.0)


async def _take(address: str) -> None:
    """Take pictures until the server ends."""
    import aiohttp

    with suppress(aiohttp.ClientError):
        async with (
            aiohttp.ClientSession() as client,
            client.ws_connect(f'{address}/live', headers={'Origin': address}) as socket,
        ):
            async for _ in socket:
                pass
