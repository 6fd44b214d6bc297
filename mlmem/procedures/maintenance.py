# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Maintenance: the calibration; the self-test of actuator, transducers, erase and every level; and
the reset, the way home of an element that no strain brings back.
"""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..commands import Check, Outcome
from ..errors import OutcomeCode, ProcedureFailed, Refused
from ..instrument.blocks import Procedure, catch_up, ramp_strain, wait
from ..instrument.echo import detection_threshold
from ..instrument.end import End
from ..memory import Memory
from ..moves.kick import kick_out
from ..moves.move import blank_content, erasing_moves, find_route
from ..moves.strain_cycle import return_to_zero
from ..physics import StateError
from ..procedure_table import UNSET_SEED
from ..readers.decoding import MAX_THRESHOLD_FACTOR
from ..readers.listening import noise_floor, wait_for_decay
from ..readers.reader import Writer
from ..readers.reading import BLANK, UNDECODABLE, Reading, find_failure_code
from . import writing


def calibrate(element: Memory) -> Procedure[Outcome]:
    """Calibrate the reader of an element, and restore the content in any case but an abort.

    If the reader ends early, by a failure, an abort or a fault, the old calibration is kept.

    Raises:
        ProcedureFailed: As `Reader.calibrate`, or the content could not be restored.
    """
    yield from return_to_zero(element)
    content = yield from element.reader.read_settled(element)
    known = element.calibration
    writer = Writer(writing.write, writing.erase, writing.go_to_level, kick_out)
    try:
        found = yield from element.reader.calibrate(element, writer)
    except BaseException as failure:  # an abort closes the procedure
        element.calibration = known
        if not isinstance(failure, ProcedureFailed):
            raise
        try:
            yield from writing.restore_content(element, content)
        except ProcedureFailed as lost:
            text = f'{failure}; nor was the content restored: {lost}'
            raise ProcedureFailed(text) from failure
        raise
    return replace((yield from writing.restore_content(element, content)), **found)


Tested = tuple[bool, str, dict[str, float]]
"""Whether a test passed, its result in words, and the measured values."""


def self_test(element: Memory) -> Procedure[Outcome]:
    """Test everything, with one check each, and restore the content.

    If a transducer or the actuator fails, nothing is written and the content stays; but kicks
    need no actuator. A failing level does not stop the test of others.

    Raises:
        ProcedureFailed: The content cannot be read and so could not be restored; nothing is
            written.
    """
    yield from return_to_zero(element)
    content = yield from element.reader.read_settled(element)
    if content.level == UNDECODABLE:
        raise ProcedureFailed(
            f'not tested: the content cannot be read now ({content.reason}) and so could not be '
            'restored; write a level or erase first',
        )
    checks = []
    for end in element.transducer.ends:
        checks.append((yield from _run_test(f'transducer {end}', _test_transducer(element, end))))
    able = all(check.passed for check in checks)
    if able and element.settings.actuator.present:
        checks.append((yield from _run_test('actuator', _test_actuator(element))))
        able = checks[-1].passed or _is_strainless(element)
    if able:
        checks.append((yield from _run_test('erase', _test_erase(element))))
        for level, number in element.reader.single_walls.items():
            checks.append((yield from _run_test(f'level {level}', _test_level(element, number))))
        checks.append((yield from _run_test('restore', _test_restore(element, content))))
    failed = ', '.join(check.name for check in checks if not check.passed)
    code = find_failure_code(element.reading) if failed else OutcomeCode.OK
    error = f'failed: {failed}' if failed else ''
    return Outcome(element.reading, checks=tuple(checks), code=code, error=error)


def estimate_all_levels(element: Memory) -> float:
    """Return the time to erase, write and read every level, and to restore the content."""
    levels = (BLANK, *element.reader.single_walls.values())
    content, top = max(BLANK, writing.find_content(element)), levels[-1]
    erasing = writing.writing_time(element, top, BLANK)
    steps = sum(writing.driving_time(element, *pair) for pair in pairwise(levels))
    reads = (len(levels) - 1) * element.reader.read_duration(element)
    return erasing + steps + reads + writing.writing_time(element, top, content)


def _run_test(name: str, test: Procedure[Tested]) -> Procedure[Check]:
    """Return the check of a test, which fails if a procedure does."""
    try:
        passed, message, values = yield from test
    except ProcedureFailed as failure:
        return Check(name, False, str(failure))
    return Check(name, passed, message, values)


def _is_strainless(element: Memory) -> bool:
    """Return whether all is written and erased without strain, and the strain is zero."""
    design, settings = element.design, element.settings
    erases = any(not move.needs_actuator for move in erasing_moves(design, settings))
    strained = element.transmission.encoder_strain != 0.0
    if strained or not (erases and settings.write.avoids_strain):
        return False
    blank, contents = blank_content(settings), element.reader.single_walls.values()
    routes = [find_route(design, settings, blank, content) for content in contents]
    return not any(move.needs_actuator for route in routes for move in route)


def _test_transducer(element: Memory, end: End) -> Procedure[Tested]:
    """Measure the noise of an end's sensor: it must not raise the threshold at the last echo.

    The last echo is that of the level farthest from the end, or of the blank element.
    """
    yield from wait_for_decay(element)
    floor = noise_floor(element, end)
    table, probe = element.calibration.table(end), element.transducer.probes[end]
    last = np.array(table.longest_delay)
    needed = float(detection_threshold(probe, last))
    raised = float(detection_threshold(probe, last, floor)) / needed
    heard = (
        f'noise raises the threshold by a factor of {raised:.3g}; limit {MAX_THRESHOLD_FACTOR:g}'
    )
    values = {'floor': floor, 'threshold': needed, 'raised': raised}
    return raised <= MAX_THRESHOLD_FACTOR, heard, values


def _test_erase(element: Memory) -> Procedure[Tested]:
    yield from writing.erase(element)
    return True, 'blank', {}


def _test_actuator(element: Memory) -> Procedure[Tested]:
    """Strain the element a little, from zero, and check that its right end follows.

    As slowly as an erase, so that the end is at rest when it is measured.
    """
    times = element.settings.erase
    # a third of the strain that moves a wall
    asked = min(0.01, element.settings.actuator.max_strain)
    offset = yield from _measure_strain(element)
    yield from ramp_strain(element, asked, times.ramp)
    yield from wait(element, times.settle)
    felt = yield from _measure_strain(element)
    yield from ramp_strain(element, 0.0, times.release)
    yield from wait(element, times.settle)
    error = max(abs(offset), abs(felt - asked))
    return (
        error <= 0.05 * asked,
        f'measured strain {offset:.4f} at a set-point of 0 and {felt:.4f} at {asked:g}',
        {'offset': offset, 'felt': felt, 'asked': asked},
    )


def _measure_strain(element: Memory) -> Procedure[float]:
    """Return the strain measured at the right end, which is inactive."""
    yield from catch_up(element)
    stretched = element.transducer.measure_rest(End.RIGHT) - element.design.D_s1
    return stretched / element.design.end_displacement(1.0)


def _test_level(element: Memory, level: int) -> Procedure[Tested]:
    written = yield from writing.write(element, level)
    reading = yield from element.reader.read(element)
    delays = {'left_delay': reading.left_delay, 'right_delay': reading.right_delay}
    values = {
        'attempts': float(written.attempts),
        **{name: math.nan if delay is None else delay for name, delay in delays.items()},
        'level_margin': reading.level_margin,
        'threshold_margin': reading.threshold_margin,
        'confidence': reading.confidence,
    }
    if reading.level != level:
        found = reading.reason or element.describe_content(reading.level)
        return False, found, values
    tries = '' if written.attempts == 1 else f' after {written.attempts} attempts'
    return True, f'read{tries}', values


def _test_restore(element: Memory, content: Reading) -> Procedure[Tested]:
    yield from writing.restore_content(element, content)
    return True, element.describe_content(content.level), {}


def reset(element: Memory, content: int = BLANK, seed: int = UNSET_SEED) -> Procedure[Outcome]:
    """Replace a simulated element by a fresh one, unstrained and at rest, and read it.

    Cells driven out of their two phases stay in another ground state, from which neither an erase
    nor a write brings them back. Calibration, faults and history stay.

    Args:
        element: The element to replace.
        content: Level or word that the new element holds; `BLANK` for none.
        seed: Of the random numbers of its faults, which begin anew: with the same seed, content
            and faults the samples of all that follows are the same. `UNSET_SEED`: they go on.

    Raises:
        ProcedureFailed: The element is real, the walls of the content do not rest there, no
            material has the faults with this seed, or the new element is not read as that
            content, for instance because of a fault.
    """
    if not element.is_simulated:
        raise ProcedureFailed('a real element has to be replaced by hand; its history is kept')
    try:
        if seed != UNSET_SEED:
            element.restart_random_numbers(seed)
        element.replace_element(content)
    except Refused as refusal:
        raise ProcedureFailed(str(refusal)) from refusal
    except StateError as error:
        raise ProcedureFailed(f'{element.describe_content(content)}: {error}') from error
    reading = yield from element.reader.read(element)
    expected = blank_content(element.settings) if content == BLANK else content
    if reading.level != expected:
        why = reading.reason or element.describe_content(reading.level)
        raise ProcedureFailed(
            f'the new element is not read as {element.describe_content(expected)}: {why}',
        )
    return Outcome(reading)
