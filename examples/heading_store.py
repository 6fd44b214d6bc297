# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Several elements as one word: a heading, to a degree, in three elements.

Three elements of eight levels hold 8^3 = 512 words, and 0 to 359 degrees are 360. Start the bank
and run it twice; the second run tells what the first one left:

    ros2 launch mlmem_ros bank.launch.py elements:=3
    python3 heading_store.py 271
    python3 heading_store.py
"""

from __future__ import annotations

import argparse
import sys

from mlmem_ros import MemoryBank, RequestError, standalone

ELEMENTS = 3
CIRCLE = 360


def main() -> int:
    """Tell the heading that the bank holds, and store another one; return the exit status."""
    parser = argparse.ArgumentParser(description='Keep a heading in a bank of three elements.')
    parser.add_argument('heading', type=int, nargs='?', help='heading to store, in degrees')
    heading = parser.parse_args().heading
    try:
        with standalone() as memory:
            bank = MemoryBank.on(memory.node, ELEMENTS)
            held = bank.read().wait()
            if held.value is None:
                print('no heading is stored')
            else:
                print(f'heading {held.value} degrees, digits {held}')
            if heading is not None:
                print(f'stored as digits {bank.write(heading % CIRCLE).wait()}')
    except RequestError as error:
        print(f'heading store: {error}', file=sys.stderr)
        return 1
    return 0


if __name__ == '__main__':
    sys.exit(main())
