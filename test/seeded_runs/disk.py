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
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import patch

from mlmem import atomic_files

from .files import Directory, File
from .scheduler import Killed

ERROR_NUMBERS = (errno.ENOSPC, errno.EIO, errno.EACCES, errno.EINTR)


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
