# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem demo`: every level upward, one downward, in a table; by default a sample of them."""

import re

import pytest
from closed_bag import check_closed
from sampled import sampled

from mlmem_ros.packages import find_entry_points
from mlmem_tools.cli import demo, laboratory
from mlmem_tools.cli.main import main


@pytest.mark.parametrize(
    'levels', sampled([[1, 0], [*demo.DEMO_LEVELS]], lambda levels: levels == [1, 0])
)
def test_demo_writes_its_levels_and_records(monkeypatch, tmp_path, capfd, levels):
    monkeypatch.setattr(demo, 'DEMO_LEVELS', levels)
    status = main(['demo', '--output', str(tmp_path)])
    printed, complaints = capfd.readouterr()
    slow = 'ticks of time were skipped'  # on a busy machine
    complaints = [line for line in complaints.splitlines() if slow not in line]
    assert (status, complaints) == (0, []), printed
    rows = re.findall(r'^ *(\d) +(\d) +([01]{3}) ', printed, re.MULTILINE)
    asked = [int(asked) for asked, _, _ in rows]
    assert asked == levels
    assert [int(decoded) for _, decoded, _ in rows] == asked
    assert [int(code, 2) for _, _, code in rows] == asked
    (folder,) = tmp_path.iterdir()
    messages = check_closed(folder / 'session')
    told = [message.data for topic, _, message in messages if topic.endswith('/level')]
    assert [level for level in dict.fromkeys(told) if level >= 0] == [*dict.fromkeys(levels)]
    picture = folder / 'session.png'
    assert picture.exists() == (
        laboratory.PICTURE_PART in find_entry_points(laboratory.PARTS_GROUP)
    )
    assert not picture.exists() or picture.read_bytes().startswith(b'\x89PNG')
