# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Files and directories of a simulated disk, as shown and as safe."""

from dataclasses import dataclass, field


@dataclass(eq=False)
class File:
    """A file: shown content, safe content, and writes between them (offset, bytes, doubtful)."""

    shown: bytearray = field(default_factory=bytearray)
    safe: bytes = b''
    writes: list = field(default_factory=list)
    names: int = 1

    def copy_to(self, path):
        """Write what is shown into the real file system."""
        path.write_bytes(self.shown)

    def sync(self):
        """Make the writes safe, except those whose earlier sync failed."""
        self.safe = _apply_writes(self.safe, [write for write in self.writes if not write[2]])
        self.writes = [write for write in self.writes if write[2]]

    def doubt(self):
        """Treat the writes as lost: a sync failed, and the next one will not report it."""
        self.writes = [(offset, content, True) for offset, content, _ in self.writes]

    def lose(self, random):
        """Lose what was not safe, or part of it."""
        kept = _choose_kept(self.writes, random)
        if kept and random.random() < 0.5:
            offset, content, _ = kept[-1]
            kept[-1] = offset, content[: random.randrange(len(content) + 1)], False
        self.safe = _apply_writes(self.safe, kept)
        self.shown, self.writes, self.names = bytearray(self.safe), [], 0


@dataclass(eq=False)
class Directory:
    """A directory: shown entries, safe entries, and the changes between them.

    A change maps names to their new entries, or None: a rename changes two names, and is atomic.
    """

    shown: dict = field(default_factory=dict)
    safe: dict = field(default_factory=dict)
    changes: list = field(default_factory=list)
    names: int = 1

    def copy_to(self, path):
        """Write what is shown, and all below it, into the real file system."""
        path.mkdir(exist_ok=True)
        for name, node in self.shown.items():
            node.copy_to(path / name)

    def change(self, **names):
        """Change entries."""
        self.changes.append(names)
        self.shown = _apply_change(self.shown, names)

    def sync(self):
        """Make the entries safe."""
        self.safe, self.changes = dict(self.shown), []

    def doubt(self):
        """Do nothing: changes of a directory stay in the journal; the next sync reports them."""

    def lose(self, random):
        """Lose all or some changes that were not safe, here and in everything below."""
        for names in _choose_kept(self.changes, random):
            self.safe = _apply_change(self.safe, names)
        self.shown, self.changes = dict(self.safe), []
        for node in self.shown.values():
            node.lose(random)
            node.names = 1


def _choose_kept(things, random):
    """Return all, none, the first ones or any of the unsynced writes, in order."""
    match random.randrange(4):
        case 0:
            return list(things)
        case 1:
            return []
        case 2:
            return list(things[: random.randrange(len(things) + 1)])
    return [thing for thing in things if random.random() < 0.5]


def _apply_writes(content, writes):
    """Return content after some writes; a gap before one that came through is zero."""
    content = bytearray(content)
    for offset, written, _ in writes:
        if not written:
            continue
        if len(content) < offset:
            content.extend(bytes(offset - len(content)))
        content[offset : offset + len(written)] = written
    return bytes(content)


def _apply_change(entries, names):
    """Return the entries of a directory after a change."""
    entries = {**entries, **names}
    return {name: node for name, node in entries.items() if node is not None}
