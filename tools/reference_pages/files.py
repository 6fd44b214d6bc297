# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Formats of files, whose keys are compared with those that are written."""

import dataclasses
import inspect
import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import Any

from mlmem import Read, element_file, new_element, preset, snapshot
from mlmem.moves import corrections
from mlmem.physics import Specimen
from mlmem_ros.bag import jazzy, writer
from mlmem_ros.host import design_check, state_file
from mlmem_ros.session import records

from . import keys
from .table import table


def files_page() -> str:
    """Return the formats, whose keys are compared with those of an element's files."""
    element = new_element(preset('bits_1'))
    taken, corrected = (
        snapshot.take_snapshot(element),
        corrections.PulseCorrections((corrections.PulseCorrection(),) * 2, '', (1.0,) * 2),
    )
    calibrated = dataclasses.replace(element.calibration, pulse_corrections=corrected).as_dict()
    made = Specimen(element.design, k_r_factor=1.01, offset=0.01)
    known = element_file.Element(
        dataclasses.replace(made, mass=2.0, stuck=(9,)), made.alpha, 1.01,
        {'left': (0.0, 1.0)}, data=1, plan=corrected,
    )  # fmt: skip
    element.made, element.forecast, element.twin = made, element.calibration, made
    header = _content(records.build_header(element, '/mlmem', {}))
    hashed = _content(records.build_state_hash(element))
    command = _content(records.build_command(0, Read()))
    arguments = ['...'] if command.keys() - {'tick', 'kind'} else []
    channel = [[f'`{key}`', meaning] for key, meaning in keys.CHANNEL.items()]
    custom = [[f'`{key}`', meaning] for key, meaning in keys.CUSTOM_DATA.items()]
    own = [[f'`~/{name}`', meaning] for name, meaning in keys.TOPICS.items()]
    parts = [
        '# Files',
        'The parameters of the node name its files, which are below `files.root` if that is set. '
        'JSON files are replaced atomically: after a power cut a file has its old content or the '
        'new one. Numbers are stored exactly.',
        '## Session',
        'The directory of `record.path` or `mlmem record`: a rosbag2 bag of `metadata.yaml` '
        '(version 9) and `NAME_0.mcap`, `NAME_1.mcap` ... of the profile `ros2`, with schemas in '
        f'`ros2msg`, CDR messages and zstd chunks of {writer.CHUNK_BYTES // 1024} KiB with a '
        'CRC. It holds every [topic](topics.md) of the node (images and markers with '
        "`record.views`). The storage plugin of Jazzy's rosbag2, built from source, reads "
        'metadata, topics, definitions and every message of the golden sessions. Besides the '
        'topics it holds:',
        table(['topic', 'messages'], own),
        'All but the count are std_msgs/String with a JSON object.',
        f'### `~/{records.HEADER_TOPIC}`',
        _keys(keys.SESSION[records.HEADER_TOPIC], header),
        f'### `~/{records.COMMAND_TOPIC}`',
        _keys(keys.SESSION[records.COMMAND_TOPIC], ['tick', 'kind', *arguments]),
        f'### `~/{records.STATE_HASH_TOPIC}`',
        _keys(keys.SESSION[records.STATE_HASH_TOPIC], hashed),
        '### Metadata',
        table(["key of a channel's metadata", 'meaning'], channel),
        table(['key of `custom_data` in `metadata.yaml`', 'meaning'], custom),
        '### The last seconds',
        '`record.last_seconds` keeps them in memory, in no file. A session that begins with them, '
        'or that a failed device leaves, has the same format.',
        '## State',
        'The file of `state.path`: the content of a memory between two runs.',
        _keys(keys.STATE, _written(state_file.save_snapshot, taken)),
        'The snapshot:',
        _keys(keys.SNAPSHOT, taken),
        'Beside the state file `NAME.json`, `.NAME.json.lock` names the node that uses it. It '
        'means nothing once that node has ended.',
        '## Calibration',
        f'`{state_file.calibration_path(Path("NAME.json"))}` beside the state file '
        '`NAME.json`: one for each design and settings that the element has had.',
        _keys(keys.CALIBRATIONS, _written(state_file.save_calibration, '', element.calibration)),
        'A calibration:',
        _keys(keys.CALIBRATION, calibrated),
        'A delay table:',
        _keys(keys.TABLE, calibrated['right']),
        'Pulse corrections:',
        _keys(keys.PULSE_CORRECTIONS, calibrated['pulse_corrections']),
        '## Element',
        f'{_about(element_file)} {_about(element_file, 1)} The groups of settings are on '
        '[their own page](settings.md). The parameters `element` and `twin` name such files.',
        _keys(keys.ELEMENT, known.as_dict()),
        '## Design checks',
        f'`{design_check.CACHE_FILE_NAME}`. {_about(design_check, 1)} It is a JSON object '
        f'of the latest {design_check.MAX_CACHED_DESIGNS} designs: by a hash of sources, design '
        f'and settings, a '
        'list of findings (name, verdict, text, values) that are no pass, and of read disturb.',
        '## Parameter files',
        'YAML as for any ROS node: `/**`, `ros__parameters`, and below it '
        '[parameters](parameters.md) that are no defaults. `memory.launch.py` takes one as '
        '`params_file:=FILE`.',
    ]
    return '\n\n'.join(parts) + '\n'


def _keys(meanings: Mapping[str, str], found: Iterable[str]) -> str:
    """Return a table of keys; raise `ValueError` unless they are those in a file."""
    if wrong := set(meanings) ^ set(found):
        raise ValueError(f'keys and their descriptions must agree; got {sorted(wrong)}')
    return table(['key', 'meaning'], ([f'`{key}`', text] for key, text in meanings.items()))


def _about(module: ModuleType, paragraph: int = 0) -> str:
    """Return a paragraph of a module's docstring."""
    return (inspect.getdoc(module) or '').split('\n\n')[paragraph].replace('\n', ' ')


def _written(save: Callable[..., None], *content: Any) -> Any:
    """Return what is in a file that was saved."""
    with TemporaryDirectory() as folder:
        path = Path(folder, 'file.json')
        save(path, *content)
        return json.loads(path.read_text(encoding='utf-8'))


def _content(cdr: bytes) -> Any:
    return json.loads(jazzy.deserialize_message(cdr, records.STRING_TYPE).data)
