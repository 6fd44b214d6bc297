# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Draw what the shipped layouts show, from the messages of a session, for the README.

Panels are where the layout files put them, and hold what the layout files name. The tools
themselves are not asked.

    .venv/bin/memory_node --ros-args -p record.path:=session -p record.views:=true
    .venv/bin/python tools/draw_views.py session
"""

import json
import re
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from rosbags.highlevel import AnyReader

ROOT = Path(__file__).resolve().parent.parent
CONFIG, IMAGES = ROOT / 'config', ROOT / 'docs' / 'images'
DARK, PANEL, LIGHT = '#15151a', '#202024', '#e6e6e6'
CUBE, CUBE_LIST, TEXT = 1, 6, 9  # types of visualization_msgs/Marker
ADD = 0
WINDOW = 10.0  # seconds shown

Messages = dict[str, list[tuple[float, Any]]]


def load(bag: Path) -> Messages:
    """Return the messages of every topic with their times in seconds."""
    found: Messages = {}
    with AnyReader([bag]) as reader:
        for connection, stamp, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            time = 1e-9 * (stamp - reader.start_time)
            found.setdefault(connection.topic, []).append((time, message))
    return found


def end_of(messages: Messages) -> float:
    """Return the time of the last message."""
    return max(series[-1][0] for series in messages.values())


# --- Foxglove ----------------------------------------------------------------------------


def draw_foxglove(messages: Messages, path: Path) -> None:
    """Draw the panels of config/foxglove_layout.json."""
    layout = json.loads((CONFIG / 'foxglove_layout.json').read_text())
    figure = Figure(figsize=(12.0, 7.2), facecolor=DARK)
    for name, (x, y, width, height) in places(layout['layout']).items():
        panel = layout['configById'][name]
        area = (x + 0.004, y + 0.006, width - 0.008, height - 0.012)
        block(figure, area, PANEL)
        title = panel.get('foxglovePanelTitle') or panel.get('title') or name.split('!')[0]
        figure.text(x + 0.01, y + height - 0.012, title, color='0.7', size=7, va='top')
        DRAWN[name.split('!')[0]](figure, area, panel, messages)
    figure.savefig(path, dpi=100, facecolor=DARK)


def places(node: Any, x: float = 0.0, y: float = 0.0, w: float = 1.0, h: float = 1.0) -> Any:
    """Return left, bottom, width and height of every panel of a mosaic."""
    if isinstance(node, str):
        return {node: (x, y, w, h)}
    share = node['splitPercentage'] / 100
    if node['direction'] == 'row':
        return places(node['first'], x, y, share * w, h) | places(
            node['second'], x + share * w, y, (1 - share) * w, h
        )
    return places(node['first'], x, y + (1 - share) * h, w, share * h) | places(
        node['second'], x, y, w, (1 - share) * h
    )


def block(figure: Any, area: Any, colour: str) -> None:
    """Fill a part of the figure, behind all axes."""
    x, y, width, height = area
    shape = Rectangle((x, y), width, height, color=colour, transform=figure.transFigure, zorder=-1)
    figure.add_artist(shape)


def inset(figure: Any, area: Any, left: float, bottom: float, right: float, top: float) -> Any:
    """Return axes within a panel; margins in figure units."""
    x, y, width, height = area
    axes = figure.add_axes((x + left, y + bottom, width - left - right, height - bottom - top))
    axes.set_facecolor(PANEL)
    axes.tick_params(colors='0.7', labelsize=6, length=2)
    for spine in axes.spines.values():
        spine.set_color('0.4')
    return axes


def draw_scene(figure: Any, area: Any, panel: Any, messages: Messages) -> None:
    """Draw the markers from above."""
    axes = inset(figure, area, 0.0, 0.0, 0.0, 0.02)
    axes.axis('off')
    aspect = area[2] / area[3] * 12.0 / 7.2
    height = panel['cameraState']['distance']
    centre = panel['cameraState']['targetOffset'][0]
    axes.set_xlim(centre - 0.5 * height * aspect, centre + 0.5 * height * aspect)
    axes.set_ylim(-0.5 * height, 0.5 * height)
    points_per_metre = 72 * area[3] * 7.2 / height
    for topic in panel['topics']:
        for marker in sorted(messages[topic][-1][1].markers, key=lambda m: m.ns != 'substrate'):
            if marker.action != ADD:
                continue
            at, size, paint = marker.pose.position, marker.scale, rgb(marker.color)
            if marker.type == TEXT:
                axes.text(
                    at.x,
                    at.y,
                    marker.text,
                    color=paint,
                    size=0.8 * size.z * points_per_metre,
                    ha='center',
                    va='center',
                )
            boxes = [(at, paint)] if marker.type == CUBE else []
            if marker.type == CUBE_LIST:
                boxes = list(zip(marker.points, map(rgb, marker.colors), strict=True))
            for box, colour in boxes:
                corner = (box.x - size.x / 2, box.y - size.y / 2)
                axes.add_patch(Rectangle(corner, size.x, size.y, color=colour, lw=0, snap=False))


def rgb(colour: Any) -> tuple[float, float, float]:
    """Return a colour as matplotlib wants it."""
    return (colour.r, colour.g, colour.b)


def draw_image(figure: Any, area: Any, panel: Any, messages: Messages) -> None:
    """Draw the last image."""
    image = messages[panel['imageMode']['imageTopic']][-1][1]
    axes = inset(figure, area, 0.0, 0.005, 0.0, 0.03)
    axes.imshow(np.array(image.data).reshape(image.height, image.width, 3))
    axes.axis('off')


def draw_plot(figure: Any, area: Any, panel: Any, messages: Messages) -> None:
    """Draw the last seconds of every path."""
    axes = inset(figure, area, 0.042, 0.03, 0.008, 0.03)
    for path in panel['paths']:
        topic, _, rest = path['value'].partition('.')
        field, index = re.fullmatch(r'(\w+)\[(:|\d+)\]', rest).groups()
        points = [
            (time, value)
            for time, message in messages[topic]
            for value in getattr(message, field)[slice(None) if index == ':' else [int(index)]]
        ]
        line = '.' if index == ':' else '-'
        axes.plot(*zip(*points, strict=True), line, ms=1.5, lw=1.0, color=path['color'])
        axes.plot([], [], color=path['color'], label=path['label'])
    axes.legend(fontsize=6, loc='upper left', labelcolor=LIGHT, facecolor=PANEL, edgecolor='0.4')
    axes.set_ylabel(panel['yAxisLabel'], color='0.7', size=6)
    axes.set_xlim(end_of(messages) - WINDOW, end_of(messages))


def draw_states(figure: Any, area: Any, panel: Any, messages: Messages) -> None:
    """Draw the values of every path as bars."""
    axes = inset(figure, area, 0.01, 0.03, 0.008, 0.03)
    end = end_of(messages)
    axes.set(xlim=(end - WINDOW, end), ylim=(-len(panel['paths']), 0.35), yticks=[])
    for row, path in enumerate(panel['paths']):
        topic, field = path['value'].split('.')
        axes.text(end - WINDOW, -row + 0.05, f' {path["label"]}', color='0.7', size=6)
        times = [time for time, _ in messages[topic]] + [end]
        for (begin, message), until in zip(messages[topic], times[1:], strict=True):
            begin = max(begin, end - WINDOW)
            if until <= begin:
                continue
            value = getattr(message, field)
            colour = f'C{crc32(str(value).encode()) % 10}'
            axes.add_patch(Rectangle((begin, -row - 0.55), until - begin, 0.5, color=colour))
            if until - begin > (1.2 if isinstance(value, str) else 0.3):
                axes.text(
                    begin, -row - 0.3, f' {value}', color='w', size=6, va='center', clip_on=True
                )


def draw_indicator(figure: Any, area: Any, panel: Any, messages: Messages) -> None:
    """Draw the rule that the last value meets."""
    topic, field = panel['path'].split('.')
    value = str(getattr(messages[topic][-1][1], field))
    rule = next(rule for rule in panel['rules'] if rule['rawValue'] == value)
    x, y, width, height = area
    block(figure, (x, y, width, height - 0.028), rule['color'])
    figure.text(
        x + width / 2, y + height / 2, rule['label'], color='w', size=13, ha='center', va='center'
    )


def draw_button(figure: Any, area: Any, panel: Any, messages: Messages) -> None:
    """Draw the button that calls a service."""
    x, y, width, height = area
    figure.text(
        x + width / 2,
        y + 0.42 * height,
        f' {panel["buttonText"]} ',
        color='w',
        size=8,
        ha='center',
        va='center',
        bbox={'boxstyle': 'round', 'facecolor': panel['buttonColor'], 'edgecolor': 'none'},
    )


def draw_parameters(figure: Any, area: Any, panel: Any, messages: Messages) -> None:
    """Draw the first parameters, from the session's header."""
    (_, header) = messages['/mlmem/session'][0]
    parameters = json.loads(header.data)['parameters']
    names = ['target_level', *(name for name in sorted(parameters) if name != 'target_level')]
    table(figure, area, [(name, short(parameters[name])) for name in names], 0.62)


def short(value: Any) -> str:
    """Return a value as a table has room for it."""
    return f'{value:.6g}' if isinstance(value, float) else str(value)


def draw_health(figure: Any, area: Any, panel: Any, messages: Messages) -> None:
    """Say what the panel listens to: a session does not hold it."""
    table(figure, area, [(panel['topicToRender'], ''), ('(live only)', '')], 0.5)


def table(figure: Any, area: Any, rows: list[tuple[str, str]], column: float) -> None:
    """Write as many rows as there is room for."""
    x, y, width, height = area
    for row, (name, value) in enumerate(rows[: int((height - 0.05) / 0.021)]):
        at = y + height - 0.045 - 0.021 * row
        figure.text(x + 0.008, at, name, color=LIGHT, size=6, va='center')
        figure.text(x + column * width, at, value, color='#f2a61a', size=6, va='center')


DRAWN = {
    '3D': draw_scene,
    'Image': draw_image,
    'Plot': draw_plot,
    'StateTransitions': draw_states,
    'Indicator': draw_indicator,
    'CallService': draw_button,
    'Parameters': draw_parameters,
    'DiagnosticSummary': draw_health,
}


# --- PlotJuggler -------------------------------------------------------------------------


def draw_plotjuggler(messages: Messages, path: Path) -> None:
    """Draw the first tab of config/plotjuggler.xml."""
    tab = ET.parse(CONFIG / 'plotjuggler.xml').getroot().find('tabbed_widget/Tab')
    areas = tab.findall('.//DockArea')
    sizes = [float(size) for size in tab.find('.//DockSplitter').get('sizes').split(';')]
    figure = Figure(figsize=(11.0, 7.0), layout='constrained')
    for axes, area in zip(
        figure.subplots(len(areas), 1, sharex=True, height_ratios=sizes), areas, strict=True
    ):
        plot = area.find('plot')
        style = 'steps-post' if plot.get('style') == 'Steps' else 'default'
        for curve in plot.findall('curve'):
            points = series(messages, curve.get('name'))
            label = curve.get('name')
            axes.plot(*points, color=curve.get('color'), drawstyle=style, lw=1.2, label=label)
        limits = plot.find('limitY')
        if limits.get('min'):
            axes.set_ylim(float(limits.get('min')), float(limits.get('max')))
        axes.set_title(area.get('name'), size=8)
        axes.grid(color='0.85', lw=0.5)
        axes.legend(fontsize=7, loc='center left', bbox_to_anchor=(1.0, 0.5), frameon=False)
        axes.tick_params(labelsize=7)
    axes.set_xlabel('time in s', size=8)
    figure.savefig(path, dpi=100)


def series(messages: Messages, name: str) -> tuple[list[float], list[float]]:
    """Return times and values of a series by the name that PlotJuggler gives it."""
    topic = next(topic for topic in messages if name.startswith(f'{topic}/'))
    rest = name[len(topic) + 1 :]
    times, values = [], []
    for time, message in messages[topic]:
        if '/' in rest:
            joint, value = rest.split('/')
            found = [getattr(message, value)[message.name.index(joint)]]
        elif (indexed := re.fullmatch(r'(\w+)\[(\d+)\]', rest)) is not None:
            field, index = indexed.groups()
            found = list(getattr(message, field)[int(index) : int(index) + 1])
        else:
            found = [getattr(message, rest)]
        times += [time] * len(found)
        values += found
    return times, values


if __name__ == '__main__':
    session = load(Path(sys.argv[1]))
    draw_foxglove(session, IMAGES / 'foxglove.png')
    draw_plotjuggler(session, IMAGES / 'plotjuggler.png')
