# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""While a loop runs, its thread alone reads and changes its device: whoever else does is found."""

import sys
import threading
from contextlib import ExitStack, contextmanager
from unittest.mock import patch

from mlmem import Loop, MemoryElement

CONSTANT = {
    'content_name', 'design', 'driver', 'elongation', 'made', 'settings', 'is_simulated',
    'specimen', 'steps_per_tick', 'tick', '__class__', '__dict__',
}  # fmt: skip
"""What never changes, or is computed from that alone: any thread may read it."""


@contextmanager
def owned(find, here=threading.current_thread):
    """Watch all devices that loops run.

    Args:
        find: Called with what was found, in words. What tests themselves read does not count.
        here: Returns the present thread.
    """
    owners, run = {}, Loop._run_until_closed

    def _run(self):
        owners[id(self.element)] = here()
        try:
            run(self)
        finally:
            del owners[id(self.element)]

    def tell(owner, what):
        frame = sys._getframe(2)
        file = frame.f_code.co_filename
        if '/mlmem_ros/' in file.rpartition('/test/')[2]:
            place = f'{file.rpartition("/mlmem_ros/")[2]}:{frame.f_lineno}'
            find(f'{here().name} touches {what} of a device that {owner.name} runs, in {place}')

    def watch(access):
        def watched(self, name, *value):
            owner = owners.get(id(self))
            if owner is not None and name not in CONSTANT and here() is not owner:
                tell(owner, name)
            return access(self, name, *value)

        return watched

    with ExitStack() as stack:
        stack.enter_context(patch.object(Loop, '_run_until_closed', _run))
        for name in ('__getattribute__', '__setattr__'):
            watched = watch(getattr(object, name))
            stack.enter_context(patch.object(MemoryElement, name, watched))
        yield
