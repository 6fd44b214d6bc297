# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What stands on a simulated disk: files and directories, as shown, and as they are safe."""

from dataclasses import dataclass, field


@dataclass(eq=False)
class File:
    """A file: what it shows, what is safe, and the writes in between (offset, bytes, doubtful)."""

    shown: bytearray = field(default_factory=bytearray)
    safe: bytes = b''
    writes: list = field(default_factory=list)
    names: int = 1

    def sync(self):
        """Make safe what was written, but for what an earlier sync failed to."""
        self.safe = _after(self.safe, [write for write in self.writes if not write[2]])
        self.writes = [write for write in self.writes if write[2]]

    def doubt(self):
        """Hold what was written for lost: a sync failed, and the next one will not tell."""
        self.writes = [(offset, content, True) for offset, content, _ in self.writes]

    def lose(self, random):
        """Lose what was not safe, or parts of it."""
        kept = _some(self.writes, random)
        if kept and random.random() < 0.5:
            offset, content, _ = kept[-1]
            kept[-1] = offset, content[: random.randrange(len(content) + 1)], False
        self.safe = _after(self.safe, kept)
        self.shown, self.writes, self.names = bytearray(self.safe), [], 0


@dataclass(eq=False)
class Directory:
    """A directory: its entries as shown, as safe, and the changes in between.

    A change is a mapping of names to what they stand for now, None for nothing: a rename changes
    two names, and takes place whole or not at all.
    """

    shown: dict = field(default_factory=dict)
    safe: dict = field(default_factory=dict)
    changes: list = field(default_factory=list)
    names: int = 1

    def change(self, **names):
        """Change entries."""
        self.changes.append(names)
        self.shown = _changed(self.shown, names)

    def sync(self):
        """Make the entries safe."""
        self.safe, self.changes = dict(self.shown), []

    def doubt(self):
        """Nothing: a directory's changes stand in the journal, and the next sync tells."""

    def lose(self, random):
        """Lose changes that were not safe, or some of them; and so in all that is below."""
        for names in _some(self.changes, random):
            self.safe = _changed(self.safe, names)
        self.shown, self.changes = dict(self.safe), []
        for node in self.shown.values():
            node.lose(random)
            node.names = 1


def _some(things, random):
    """Return all, none, the first ones or any of what was not synced, in their order."""
    match random.randrange(4):
        case 0:
            return list(things)
        case 1:
            return []
        case 2:
            return list(things[: random.randrange(len(things) + 1)])
    return [thing for thing in things if random.random() < 0.5]


def _after(content, writes):
    """Return content after some writes; what lies before one that came through is zero."""
    content = bytearray(content)
    for offset, written, _ in writes:
        if not written:
            continue
        if len(content) < offset:
            content.extend(bytes(offset - len(content)))
        content[offset : offset + len(written)] = written
    return bytes(content)


def _changed(entries, names):
    """Return the entries of a directory after a change."""
    entries = {**entries, **names}
    return {name: node for name, node in entries.items() if node is not None}
