# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rows of a campaign on disk: its ledger, which survives a kill, and its table."""

from __future__ import annotations

import csv
import fcntl
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import IO, Any

from mlmem_ros.durable import write_atomically
from mlmem_ros.outside import DecodeError, require_regular

from .campaign import Campaign, CampaignError, Row

BEGINNING = b'{"campaign":'


class Ledger:
    """A file of JSON lines: the campaign's definition, then one row per finished point.

    Every row is handed to the system before the next is taken. A kill can tear the last line; it
    is dropped when the ledger is opened again, and its point is evaluated again. Use the ledger as
    a context manager; a second process that opens it is refused.

    Attributes:
        path: The file.
        rows: The finished rows by point.
    """

    def __init__(self, path: Path, campaign: Campaign) -> None:
        """Open the ledger of a campaign, to begin or to continue it.

        Args:
            path: The file; its folder must exist.
            campaign: The campaign that the ledger must belong to.

        Raises:
            CampaignError: It belongs to another campaign, is in use, or is not a ledger.
            OSError: The file cannot be read or written.
        """
        self.path = path
        self.rows: dict[int, Row] = {}
        if path.exists():
            _require_regular(path)
        self._stream: IO[bytes] = path.open('ab+')
        try:
            self._lock()
            self._read(campaign)
        except BaseException:
            self._stream.close()
            raise

    def __enter__(self) -> Ledger:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def append(self, row: Row) -> None:
        """Store the row of a point.

        Raises:
            OSError: The disk is full or gone.
        """
        self._write(row)
        self.rows[row['point']] = row

    def table(self) -> list[Row]:
        """Return the finished rows in the order of their points."""
        return [self.rows[point] for point in sorted(self.rows)]

    def _lock(self) -> None:
        try:
            fcntl.flock(self._stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise CampaignError(
                f'{self.path} is in use by another process; wait for it or end it'
            ) from None

    def _read(self, campaign: Campaign) -> None:
        self._stream.seek(0)
        content = self._stream.read()
        whole = content.rfind(b'\n') + 1
        if whole:
            definition, self.rows = _parsed(self.path, content[:whole])
            self._check(definition, campaign)
        elif not content.startswith(BEGINNING[: len(content)]):
            raise CampaignError(f'{self.path} is not the ledger of a campaign')
        self._stream.truncate(whole)
        if not whole:
            self._write({'campaign': campaign.definition()})

    def _check(self, found: dict[str, Any], campaign: Campaign) -> None:
        wanted, points = json.loads(json.dumps(campaign.definition())), campaign.points
        other = [name for name in wanted if wanted[name] != found.get(name)]
        if not other and not all(
            0 <= point < len(points) and points[point].items() <= row.items()
            for point, row in self.rows.items()
        ):
            other = ['set of points']
        if other:
            raise CampaignError(
                f'{self.path} belongs to a study with another {", ".join(other)}; '
                'give this one its own folder, or remove that one'
            )

    def _write(self, line: Row) -> None:
        self._stream.write(json.dumps(line, separators=(',', ':')).encode() + b'\n')
        self._stream.flush()


def read(path: Path) -> tuple[dict[str, Any], list[Row]]:
    """Return the definition and the rows of a ledger in the order of their points.

    Unlike `Ledger` it needs no campaign, and accepts a ledger that is still being written.

    Raises:
        CampaignError: It is not a ledger.
        OSError: It cannot be read.
    """
    if path.exists():
        _require_regular(path)
    content = path.read_bytes()
    definition, rows = _parsed(path, content[: content.rfind(b'\n') + 1])
    return definition, [rows[point] for point in sorted(rows)]


def _require_regular(path: Path) -> None:
    try:
        require_regular(path)
    except DecodeError as error:
        raise CampaignError(str(error)) from error


def _parsed(path: Path, content: bytes) -> tuple[dict[str, Any], dict[int, Row]]:
    """Return the definition in a ledger's whole lines, and its rows by point."""
    try:
        head, *rows = map(json.loads, content.splitlines())
        return head['campaign'], {int(row['point']): row for row in rows}
    except (ValueError, LookupError, TypeError) as error:
        raise CampaignError(f'{path} is not the ledger of a campaign; {error!r}') from error


def save_table(rows: Sequence[Row], path: Path) -> Path:
    """Write rows as CSV and return the file.

    Args:
        rows: At least one, all with the same names.
        path: The file.

    Raises:
        OSError: It cannot be written.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator='\n')
    writer.writeheader()
    writer.writerows(rows)
    write_atomically(path, text.getvalue())
    return path
