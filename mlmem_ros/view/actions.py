# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a page may ask for, as client requests to the node; nothing else gets through."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from time import strftime
from typing import TYPE_CHECKING, Any

from ..device import Faults
from .element import FAULTS, Element

if TYPE_CHECKING:
    from ..ros.client import MemoryClient
    from ..ros.client.reply import Reply

Asked = Mapping[str, Any]

HEALTHY = Faults()

HASTE = 1.65
"""Duration of a drag's move, relative to the least for a straight one; a smooth one needs 1.5."""


class BadRequest(Exception):
    """A page sent an invalid request; the message says why."""


class Actions:
    """Turns a page's messages into requests.

    Attributes:
        folder: Where recordings started by pages go, on the node's machine.
    """

    def __init__(self, client: MemoryClient, element: Callable[[], Element | None]) -> None:
        """Prepare.

        Args:
            client: A client of the node.
            element: Returns the element, if known.
        """
        self._client = client
        self._element = element
        self.folder = Path.cwd() / 'sessions'

    def ask(self, asked: Asked) -> Reply[Any]:
        """Send a page's request.

        Raises:
            BadRequest: It is not valid.
        """
        client = self._client
        match asked.get('do'):
            case 'write':
                return client.write(_whole(asked, 'level', 0, 2**16))
            case 'read':
                end = asked.get('end', '')
                if end not in ('', 'left', 'right', 'both'):
                    raise BadRequest('end must be left, right or both')
                return client.read(end=end)
            case 'erase':
                return client.erase()
            case 'calibrate':
                return client.calibrate(timeout=600.0)
            case 'self_test':
                return client.self_test(timeout=600.0)
            case 'abort':
                return client.abort()
            case 'strain':
                return self._strain(_number(asked, 'strain', -1.0, 1.0))
            case 'pause':
                return client.pause(asked.get('hold') is not False)
            case 'step':
                return client.step()
            case 'speed':
                speed = _number(asked, 'speed', 0.0, 1e6)
                return client.set_parameters({'time.speed': speed})
            case 'fault':
                return client.set_parameters({_fault(asked): _value(asked)})
            case 'heal':
                healthy = {
                    name: getattr(HEALTHY, name.partition('.')[2])
                    for name in FAULTS
                    if name != 'faults.seed'
                }
                return client.set_parameters(healthy)
            case 'record':
                on = asked.get('on') is not False
                path = str(self.folder / f'view-{strftime("%Y%m%d-%H%M%S")}')
                return client.record(on, path if on else '')
            case other:
                raise BadRequest(f'there is no request {str(other)[:40]!r}')

    def _strain(self, strain: float) -> Reply[Any]:
        """Drag the strain: a smooth move, in the time of the longest one.

        A set-point on `~/strain` would do the same, but be refused silently.
        """
        element = self._element()
        if element is None:
            raise BadRequest('the element is not known yet')
        most, rate = element.about['max_strain'], element.about['hand_rate']
        seconds = HASTE * 2.0 * most / rate * element.about['scale']['time']
        return self._client.follow([seconds], [strain], [0.0])


def _number(asked: Asked, name: str, low: float, high: float) -> float:
    value = asked.get(name)
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (number and math.isfinite(value) and low <= value <= high):  # type: ignore[arg-type,operator]
        raise BadRequest(f'{name} must be a number from {low:g} to {high:g}')
    return float(value)  # type: ignore[arg-type]


def _whole(asked: Asked, name: str, low: int, high: int) -> int:
    number = _number(asked, name, low, high)
    if number != int(number):
        raise BadRequest(f'{name} must be a whole number')
    return int(number)


def _fault(asked: Asked) -> str:
    name = f'faults.{asked.get("name")}'
    if name not in FAULTS:
        raise BadRequest("name must be a fault's name")
    return name


def _value(asked: Asked) -> bool | int | float:
    """Return a fault's value in its parameter's type."""
    kind = type(getattr(HEALTHY, str(asked['name'])))
    value = asked.get('value')
    if kind is bool:
        return bool(value)
    number = _number(asked, 'value', -1e6, 1e6)
    return int(number) if kind is int else number
