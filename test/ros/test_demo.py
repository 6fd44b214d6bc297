# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem demo`, the front door: every level upward, one downward, in a table; about 20 s."""

import itertools
import re
import subprocess
import sys

from test_signals import check_closed


def test_demo(tmp_path):
    done = subprocess.run(
        [sys.executable, '-m', 'mlmem_ros.cli.main', 'demo', '--output', str(tmp_path)],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, ''), done.stdout
    rows = re.findall(r'^ *(\d) +(\d) +([01]{3}) ', done.stdout, re.MULTILINE)
    asked = [int(asked) for asked, _, _ in rows]
    assert asked[:8] == list(range(8))
    assert any(later < earlier for earlier, later in itertools.pairwise(asked))
    assert [int(decoded) for _, decoded, _ in rows] == asked
    assert [int(code, 2) for _, _, code in rows] == asked
    (folder,) = tmp_path.iterdir()
    messages = check_closed(folder / 'session')
    levels = [message.data for topic, _, message in messages if topic.endswith('/level')]
    assert [level for level in dict.fromkeys(levels) if level >= 0] == list(range(8))
    assert (folder / 'session.png').read_bytes().startswith(b'\x89PNG')
