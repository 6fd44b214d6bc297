# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A file system in memory that may fail at every call, and forgets what was not synced.

It offers the functions of `os` that `mlmem.atomic_files` uses. The content of a file or directory
has two versions: the one that the system shows, and the one on the disk. In a power cut, whatever
was written since the last sync is lost, kept, or kept in part, depending on the seed.
"""

import errno
import fcntl
import os
import stat
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

from mlmem import atomic_files

from .scheduler import Killed

ERROR_NUMBERS = (errno.ENOSPC, errno.EIO, errno.EACCES, errno.EINTR)


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


class Disk:
    """A disk and the system calls to it.

    Attributes:
        root: The directory that all others are in.
        trouble: What happens to every call: nothing, 'full', 'fails', 'hangs', or 'moody', which
            is any of them now and then, and short writes.
        open_files: Open files of the process, by descriptor.
        troubled_at: Number of the last call in trouble.
        crash_in: Calls until the process is killed within one, or None.
        held_up: Tasks whose call hangs.
    """

    def __init__(self, scheduler):
        """Prepare an empty disk.

        Args:
            scheduler: Its tasks may hand over, or be held up, at every call.
        """
        self.trouble = ''
        self.troubled_at = 0.0
        self.crash_in = None
        self.open_files = {}
        self.root = Directory()
        self._scheduler = scheduler
        self.held_up = []

    # --- for the experimenter ------------------------------------------------------------

    def clear_trouble(self):
        """End all trouble; hanging calls go on."""
        self.trouble = ''
        self.troubled_at = self._scheduler.now
        held_up, self.held_up = self.held_up, []
        for task in held_up:
            self._scheduler.wake(task)

    def kill(self):
        """Kill the process: its files are closed, and what the system shows stays."""
        self.open_files.clear()
        self.trouble, self.crash_in = '', None
        self.held_up.clear()

    def cut_power(self):
        """Kill the process and lose everything that was not safe."""
        self.kill()
        self.root.lose(self._scheduler.random)

    def list_names(self, path='/'):
        """Return the entries of a directory; none if it does not exist."""
        try:
            return sorted(self._find_node(Path(path)).shown)
        except OSError:
            return []

    # --- the system's calls --------------------------------------------------------------

    def open(self, path, flags, _mode=0o777):
        self._begin_call('open', path)
        parent, name = self._find_parent(path)
        node = parent.shown.get(name) if name else parent
        if node is None:
            if not flags & os.O_CREAT:
                raise _make_error(errno.ENOENT, path)
            node = File()
            parent.change(**{name: node})
        elif flags & os.O_EXCL:
            raise _make_error(errno.EEXIST, path)
        if flags & os.O_TRUNC and node.shown:
            # A truncated file may come back with the old content, the new, or none.
            node.shown, node.safe = bytearray(), b''
            node.writes.clear()
        number = next(n for n in range(3, 1000) if n not in self.open_files)
        self.open_files[number] = SimpleNamespace(node=node, at=0, path=str(path), locked=False)
        return number

    def write(self, descriptor, content):
        open_file = self._open_file(descriptor)
        taken = self._begin_call('write', open_file.path, len(content))
        node, content = open_file.node, bytes(content[:taken])
        node.writes.append((open_file.at, content, False))
        node.shown[open_file.at : open_file.at + taken] = content
        open_file.at += taken
        return taken

    def read(self, descriptor, count):
        open_file = self._open_file(descriptor)
        self._begin_call('read', open_file.path)
        content = bytes(open_file.node.shown[open_file.at : open_file.at + count])
        open_file.at += len(content)
        return content

    def fsync(self, descriptor):
        node = self._open_file(descriptor).node
        try:
            self._begin_call('fsync', self._open_file(descriptor).path)
        except OSError:
            node.doubt()
            raise
        node.sync()

    def fstat(self, descriptor):
        open_file = self._open_file(descriptor)
        self._begin_call('fstat', open_file.path)
        node = open_file.node
        kind = stat.S_IFDIR if isinstance(node, Directory) else stat.S_IFREG
        return SimpleNamespace(
            st_nlink=node.names, st_size=len(node.shown), st_mode=kind, st_ino=id(node), st_dev=0
        )

    def flock(self, descriptor, _):
        ours = self._open_file(descriptor)
        others = (file for file in self.open_files.values() if file is not ours)
        if any(other.node is ours.node and other.locked for other in others):
            raise BlockingIOError(errno.EAGAIN, 'locked')
        ours.locked = True

    def close(self, descriptor):
        path = self._open_file(descriptor).path
        try:
            self._begin_call('close', path)
        finally:
            self.open_files.pop(descriptor, None)

    def replace(self, source, target):
        self._begin_call('replace', target)
        (directory, old), (there, new) = self._find_parent(source), self._find_parent(target)
        assert directory is there, 'a rename across directories is not modelled'
        if old not in directory.shown:
            raise _make_error(errno.ENOENT, source)
        if new in directory.shown:
            directory.shown[new].names = 0
        directory.change(**{old: None, new: directory.shown[old]})

    def unlink(self, path):
        self._begin_call('unlink', path)
        directory, name = self._find_parent(path)
        if name not in directory.shown:
            raise _make_error(errno.ENOENT, path)
        directory.shown[name].names = 0
        directory.change(**{name: None})

    def mkdir(self, path, _mode=0o777):
        self._begin_call('mkdir', path)
        parent, name = self._find_parent(path)
        if not name or name in parent.shown:
            raise _make_error(errno.EEXIST, path)
        parent.change(**{name: Directory()})

    def isdir(self, path):
        return self.lexists(path) and isinstance(self._find_node(Path(path)), Directory)

    def lexists(self, path):
        try:
            self._find_node(Path(path))
        except OSError:
            return False
        return True

    # --- what may befall a call ----------------------------------------------------------

    def _begin_call(self, name, path, size=0):
        """Hand over, hang or fail; return how many bytes are accepted."""
        scheduler = self._scheduler
        task = scheduler.current
        if task is None or task.outside:  # the experimenter, whom nothing befalls
            return size
        if task.ended:
            raise Killed
        if self.crash_in is not None:
            self.crash_in -= 1
            if not self.crash_in:
                self.crash_in, scheduler.crash_at = None, scheduler.handovers
        scheduler.hand_over((name, str(path)))
        trouble = self.trouble
        if not trouble:
            return size
        self.troubled_at = scheduler.now
        chance = scheduler.random
        if trouble == 'moody':
            dice = chance.random()
            if dice > 0.3:
                return size
            if dice > 0.15:
                return chance.randint(1, size) if size else 0
            trouble = 'full' if dice > 0.1 else 'fails' if dice > 0.03 else 'hangs a while'
        if trouble == 'full' and name in ('write', 'open', 'mkdir', 'fsync', 'replace'):
            raise _make_error(errno.ENOSPC, path)
        if trouble == 'fails':
            raise _make_error(chance.choice(ERROR_NUMBERS), path)
        if trouble.startswith('hangs'):
            scheduler.add_note(('held up', name, str(path)))
            self.held_up.append(task)
            while_ = None if trouble == 'hangs' else chance.choice((0.01, 1.0, 30.0))
            if not scheduler.block(f'the disk to {name} {path}', while_):
                self.held_up.remove(task)
        return size

    # --- names ---------------------------------------------------------------------------

    def _open_file(self, descriptor):
        task = self._scheduler.current
        if task is not None and task.ended:
            raise Killed
        try:
            return self.open_files[descriptor]
        except KeyError:
            raise _make_error(errno.EBADF, descriptor) from None

    def _find_node(self, path):
        node = self.root
        for name in Path(path).parts[1:]:
            if name not in node.shown:
                raise _make_error(errno.ENOENT, path)
            node = node.shown[name]
        return node

    def _find_parent(self, path):
        path = Path(path)
        return self._find_node(path.parent), path.name


@contextmanager
def mount_disk(disk):
    """Redirect all durable files to this disk."""
    names = ('open', 'write', 'read', 'fsync', 'fstat', 'close', 'replace', 'unlink', 'mkdir')
    flags = {name: value for name, value in vars(os).items() if name.startswith('O_')}
    calls = {name: getattr(disk, name) for name in names}
    path = SimpleNamespace(isdir=disk.isdir, lexists=disk.lexists)
    system = SimpleNamespace(**flags, **calls, path=path)
    with patch.object(atomic_files, 'os', system), patch.object(fcntl, 'flock', disk.flock):
        yield


def _make_error(number, what):
    return OSError(number, os.strerror(number), str(what))
