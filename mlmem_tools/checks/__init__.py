# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The design checker: what a second of computing can say about a design before any write.

It uses closed forms, equilibria and linear waves; only the launch and some steps need short runs.
It imports the device, never the reverse: a procedure may use only what is measured at the ends. No
real time, no ROS.
"""

from __future__ import annotations

from dataclasses import replace

from mlmem.element_file import Element
from mlmem.physics import Design
from mlmem.settings import ElementSettings, Settings

from . import (
    budget,
    disturb,
    echoes,
    launch,
    material,
    pinning,
    schedule,
    steps,
    transducer,
    words,
)
from .concern import Finding, Report, Subject, Verdict

__all__ = ['Finding', 'Report', 'Verdict', 'check']

CHECK_MODULES = (
    material,
    pinning,
    launch,
    schedule,
    steps,
    echoes,
    disturb,
    transducer,
    words,
    budget,
)
"""Modules with `check(subject)`, in the order of a report."""


def check(
    design: Design, settings: Settings | None = None, element: Element | None = None
) -> Report:
    """Judge a design and the settings of its instrument (by default for the paper's Case II), or
    one element of it.
    """
    settings = settings or Settings()
    if element is not None:
        settings = settings.add_stuck_cells(element.specimen.stuck)
    sound = replace(settings, element=ElementSettings())  # what is left of it is said at the end
    subject = Subject(design, sound)
    if element is not None:
        made = replace(element.timed_specimen, stuck=())
        subject = Subject(made.design, sound, made, tuple(element.corrections_by_level(settings)))
    # rules for a wall that a gradient drives over shallow defects, as in the paper, and for the
    # pulses whose delay is read. Elements read by waveform have deep, near defects, strong damping
    # and a pulse of their own; counted writes judge them.
    paper_findings = ('gradient', 'wall_width', 'pin_depth', 'carrier_left', 'carrier_right')
    # how strain launches one wall, its echoes, their pulses, and the kicks that write and erase it
    one_wall_checks = (launch, echoes, disturb, transducer)
    found = [
        finding
        for concern in CHECK_MODULES
        # without an actuator there is no strain
        if settings.actuator.present or concern not in (launch, steps)
        if not settings.holds_words or concern not in one_wall_checks
        # it judges the delays by which one wall is read
        if settings.read.method == 'delay' or concern is not echoes
        for finding in concern.check(subject)
        if settings.read.method == 'delay' or finding.name not in paper_findings
    ]
    if settings.element.bad_cells:
        found.append(words.judge_bad_cells(design, settings))
    return Report(tuple(found))
