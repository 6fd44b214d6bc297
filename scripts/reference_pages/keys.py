# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The keys of all files, and what they mean; `files` compares them with those that are written."""

from mlmem import element_file
from mlmem_ros.host import store
from mlmem_ros.session import records

TOPICS = {
    records.HEADER_TOPIC: 'where the session begins: one message, repeated in every file of a '
    'split bag',
    records.COMMAND_TOPIC: 'the commands, each with the tick at which it took effect',
    records.STATE_HASH_TOPIC: 'hashes of the state, every `record.hash_every` ticks; the last '
    'ends the '
    'session',
    records.DROPPED_TOPIC: 'running count of messages dropped from the recording '
    '(std_msgs/UInt64)',
}
"""Topics of a session below the node's name, besides those that the node publishes."""

SESSION = {
    records.HEADER_TOPIC: {
        'format': f'version of the format: {records.SESSION_FORMAT}',
        'node': 'full name of the node',
        'versions': 'versions that the bits may depend on, by name',
        'seed': 'seed of all random numbers',
        'design': 'the design, by parameter',
        'settings': 'settings of the device, by group and parameter',
        'parameters': 'parameters of the node, for information',
        'initial': 'state of the device; see the snapshot in a state file',
        'specimen': 'a simulated element that differs from its design: alpha_factor, '
        'k_r_factor, s_factor, mass, offset and eta_factor over a design, and damped_by_substrate '
        'if it is; one number stands for equal ones',
        'forecast': 'the calibration that a twin forecasts; absent without a twin',
        'twin': 'the twin by which a register is read, as `specimen`; absent without one',
    },
    records.COMMAND_TOPIC: {
        'tick': 'tick at which it took effect',
        'kind': 'name of the command, such as `Write`',
        '...': 'its arguments, by name',
    },
    records.STATE_HASH_TOPIC: {
        'tick': 'ticks that the device has done',
        'hash': "BLAKE2b hash of the material's state and clock, 32 hexadecimal digits",
        'v': 'exact displacement of every cell, as hexadecimal numbers',
    },
}
"""The JSON objects on them."""

STATE = {
    'format': f'version of the file: {store.FILE_FORMAT}',
    'snapshot': 'state of the idle device',
}
"""A state file."""

ELEMENT = {
    'format': f'version of the format: {element_file.FORMAT_VERSION}',
    'design': 'the design, by parameter, with the fitted potential, damping and substrate',
    'alpha': 'alpha_j of every cell; alpha_j d is its strength',
    'alpha_std': 'standard deviation of each',
    'mass': 'mass of every cell; absent: 1',
    'k_r': 'stiffness of every spring between the cells over k_r; absent: 1',
    'offset': 'shift of the ground states of every cell in lattice constants; absent: 0',
    'stuck': 'cells that stick to the substrate; absent: none',
    'time_unit': "the instrument's time unit in true ones",
    'transducers': 'zero, sensor gain and drive gain of the left and the right end',
    'chi2': 'misfit per datum',
    'data': 'number of data',
    'untold': 'quantities that the data do not determine',
    'plan': 'corrections of its pulses, as in a calibration; absent: not planned',
}
"""The file of a fitted element."""
