# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Small campaigns, in a module of their own: workers are processes that import it by name."""

import os
import sys
import time
from pathlib import Path

from mlmem_lab.studies.campaign import Campaign, Ledger, provide_workers, run


def noisy_square(common, values, seed):
    return {'square': values['x'] ** 2 * common['factor'], 'noise': seed % 1000}


def slow_and_logged(common, values, seed):
    """Log on disk which process computes this point; take time until there is a file `hurry`."""
    folder = Path(common['folder'])
    with (folder / 'computed.txt').open('a', encoding='utf-8') as log:
        log.write(f'{values["x"]} {os.getpid()}\n')
    if not (folder / 'hurry').exists():
        time.sleep(0.05)
    return {'y': values['x']}


def fails_at_three(common, values, seed):
    if values['x'] == 3:
        raise ArithmeticError('three is too much')
    return {'y': values['x']}


def dies(common, values, seed):
    os._exit(1)


def squares(n=12, seed=5, factor=2):
    points = [{'x': x} for x in range(n)]
    return Campaign('squares', noisy_square, {'factor': factor}, points, seed)


def logged(folder, n=60):
    points = [{'x': x} for x in range(n)]
    return Campaign('logged', slow_and_logged, {'folder': str(folder)}, points)


def main(folder):
    with Ledger(folder / 'ledger.jsonl', logged(folder)) as ledger, provide_workers(2) as executor:
        for _ in run(logged(folder), ledger, executor):
            pass


if __name__ == '__main__':
    import small_campaigns  # by its name, which the workers import it by

    small_campaigns.main(Path(sys.argv[1]))
