# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem demo`: every level upward, one downward, in a table; about 10 s."""

import itertools
import re

from closed_bag import check_closed

from mlmem_ros.packages import added
from mlmem_tools.cli import laboratory
from mlmem_tools.cli.main import main


def test_demo(tmp_path, capfd):
    status = main(['demo', '--output', str(tmp_path)])
    printed, complaints = capfd.readouterr()
    assert (status, complaints) == (0, ''), printed
    rows = re.findall(r'^ *(\d) +(\d) +([01]{3}) ', printed, re.MULTILINE)
    asked = [int(asked) for asked, _, _ in rows]
    assert asked[:8] == list(range(8))
    assert any(later < earlier for earlier, later in itertools.pairwise(asked))
    assert [int(decoded) for _, decoded, _ in rows] == asked
    assert [int(code, 2) for _, _, code in rows] == asked
    (folder,) = tmp_path.iterdir()
    messages = check_closed(folder / 'session')
    levels = [message.data for topic, _, message in messages if topic.endswith('/level')]
    assert [level for level in dict.fromkeys(levels) if level >= 0] == list(range(8))
    picture = folder / 'session.png'
    assert picture.exists() == (laboratory.PICTURE in added(laboratory.PARTS))
    assert not picture.exists() or picture.read_bytes().startswith(b'\x89PNG')
