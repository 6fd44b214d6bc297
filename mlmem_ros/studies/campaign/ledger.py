# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ledger of a campaign: every row as it comes, safe against a kill at any time."""

from __future__ import annotations

import fcntl
import json
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from .campaign import Campaign, Row
from .errors import CampaignError

BEGINNING = b'{"fingerprint":'


class Ledger:
    """A file of JSON lines: the campaign's definition, then one row per finished point.

    A row is handed to the system before the next one is taken. A kill can tear the last line; it
    is dropped when the ledger is opened again, and its point is evaluated again. Use it as a
    context manager; a second process that opens the same ledger is refused.

    Attributes:
        path: The file.
        rows: The finished rows by point.
    """

    def __init__(self, path: Path, campaign: Campaign) -> None:
        """Open the ledger of a campaign, new or to be continued.

        Args:
            path: The file; its folder must exist.
            campaign: The campaign that the ledger must belong to.

        Raises:
            CampaignError: It belongs to another campaign, is in use, or is not a ledger.
            OSError: The file cannot be read or written.
        """
        self.path = path
        self.rows: dict[int, Row] = {}
        self._stream: IO[bytes] = path.open('ab+')
        try:
            self._lock()
            self._read(campaign)
        except BaseException:
            self._stream.close()
            raise

    def __enter__(self) -> Ledger:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
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

    # --- the file --------------------------------------------------------------------------

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
        lines = content[:whole].splitlines()
        if lines:
            self._check_head(lines[0], campaign)
        elif not content.startswith(BEGINNING[: len(content)]):
            raise CampaignError(f'{self.path} is not the ledger of a campaign')
        self._stream.truncate(whole)
        if not lines:
            head = {'fingerprint': campaign.fingerprint(), 'campaign': campaign.definition()}
            self._write(head)
        for number, line in enumerate(lines[1:], start=2):
            try:
                row = json.loads(line)
                self._check_row(row, campaign)
            except (ValueError, KeyError, TypeError) as error:
                raise CampaignError(f'{self.path}, line {number}: not a row; {error!r}') from error
            self.rows[row['point']] = row

    def _check_head(self, line: bytes, campaign: Campaign) -> None:
        try:
            head = json.loads(line)
            fingerprint, found = head['fingerprint'], head['campaign']
        except (ValueError, KeyError, TypeError) as error:
            raise CampaignError(
                f'{self.path} is not the ledger of a campaign; {error!r}'
            ) from error
        if fingerprint == campaign.fingerprint():
            return
        wanted = campaign.definition()
        changed = [name for name in wanted if wanted[name] != found.get(name)]
        raise CampaignError(
            f'{self.path} is that of a study with another {", ".join(changed) or "definition"}; '
            'give this one its own folder, or remove that one'
        )

    def _check_row(self, row: Row, campaign: Campaign) -> None:
        point = row['point']
        known = 0 <= point < len(campaign.points)
        if not known or any(row[name] != value for name, value in campaign.points[point].items()):
            raise CampaignError(
                f'{self.path} is that of a study with other points: point {point} is not the '
                'same; give this one its own folder, or remove that one'
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
    content = path.read_bytes()
    lines = content[: content.rfind(b'\n') + 1].splitlines()
    try:
        definition: dict[str, Any] = json.loads(lines[0])['campaign']
        rows: list[Row] = [json.loads(line) for line in lines[1:]]
        return definition, sorted(rows, key=lambda row: row['point'])
    except (ValueError, LookupError, TypeError) as error:
        raise CampaignError(f'{path} is not the ledger of a campaign; {error!r}') from error
