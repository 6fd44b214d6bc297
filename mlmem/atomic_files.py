# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Files that survive a power cut.

It uses only functions of `os`, each through that module, so that a test can substitute its own
disk. Python itself repeats a call that a signal interrupts.
"""

from __future__ import annotations

import errno
import os
import stat
from contextlib import suppress
from pathlib import Path


class DurableFile:
    """A file that is written from its beginning to its end, and synced on the way.

    Nothing is buffered: what `write` accepted survives a crash of the program, what `sync`
    confirmed one of the machine.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._written = 0

    def tell(self) -> int:
        """Return how many bytes were written."""
        return self._written

    def flush(self) -> None:
        """Do nothing: nothing is buffered. Libraries call it."""

    def write(self, content: bytes) -> None:
        """Append bytes, all of them, in as many pieces as the system takes.

        Raises:
            OSError: The disk is full or failed; a part may have been written.
        """
        rest = memoryview(content)
        while rest:
            taken = os.write(self._descriptor, rest)
            self._written += taken
            rest = rest[taken:]

    def sync_file(self) -> None:
        """Wait until everything written is on the disk.

        Raises:
            OSError: The disk failed: what was written since the last sync may be lost, and syncing
                again would not reveal it.
        """
        os.fsync(self._descriptor)

    @property
    def is_deleted(self) -> bool:
        """Whether the file has lost its name; the system would still write into it."""
        return os.fstat(self._descriptor).st_nlink == 0

    def close(self) -> None:
        """Close the file, written but not synced. Closing again does nothing.

        Raises:
            OSError: The system reported a late error; the file is closed anyway.
        """
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)


def create_file(path: Path) -> DurableFile:
    """Create a file, which must not exist, and sync its directory.

    Raises:
        OSError: It exists, its directory is gone, the disk is full or fails.
        ValueError: The path has a NUL character.
    """
    file = _open_to_write(path, os.O_EXCL)
    try:
        sync_directory(path.parent)
    except BaseException:
        close_quietly(file)
        raise
    return file


def _open_to_write(path: Path, flag: int) -> DurableFile:
    """Open a file that need not be there, without the translation of newlines of Windows."""
    flags = os.O_WRONLY | os.O_CREAT | flag | getattr(os, 'O_BINARY', 0)
    return DurableFile(os.open(path, flags, 0o666))


def close_quietly(file: DurableFile) -> None:
    """Close a file after an error that was already reported."""
    with suppress(OSError):
        file.close()


def make_directory(path: Path, *, exist_ok: bool = False) -> None:
    """Make a directory and its missing parents, and sync theirs.

    Raises:
        OSError: It already exists, or cannot be made.
        ValueError: The path has a NUL character.
    """
    try:
        os.mkdir(path)
    except FileNotFoundError:
        if path.parent == path:
            raise
        make_directory(path.parent, exist_ok=True)
        os.mkdir(path)
    except FileExistsError:
        if not (exist_ok and os.path.isdir(path)):
            raise
        _try_sync_directory(path.parent)
        return
    sync_directory(path.parent)
    for ancestor in path.parent.parents:
        _try_sync_directory(ancestor)


def _try_sync_directory(path: Path) -> None:
    """Sync a directory in case its creator died first; we may lack the permission."""
    with suppress(OSError):
        sync_directory(path)


def sync_directory(path: Path) -> None:
    """Make the entries of a directory (files created, renamed) durable; Windows cannot.

    Raises:
        OSError: The directory is gone or the disk fails.
    """
    if not hasattr(os, 'O_DIRECTORY'):
        return
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def write_atomically(path: Path, text: str) -> None:
    """Replace the content of a file by a text in UTF-8, or leave it exactly as it was.

    Raises:
        OSError: The directory is gone, the disk is full or writing is not permitted. Only if the
            last step fails, syncing the directory, is the new content already in place; a power
            cut may then bring back the old one.
        ValueError: The path has a NUL character, or the text lone surrogates.
    """
    content = text.encode()
    # The temporary file lies beside its target because a rename is atomic only within one
    # file system. It is hidden so that no tool mistakes it for part of the bag.
    temporary = path.with_name(f'.{path.name}.new')
    file = _open_to_write(temporary, os.O_TRUNC)
    try:
        try:
            file.write(content)
            file.sync_file()
        finally:
            file.close()
        os.replace(temporary, path)
    except OSError:
        with suppress(OSError):
            os.unlink(temporary)
        raise
    sync_directory(path.parent)


def read_text(path: Path, most: int = 2**25) -> str:
    """Return the content of a regular file.

    Raises:
        FileNotFoundError: There is none.
        OSError: It cannot be read.
        ValueError: It is not UTF-8, larger than `most`, or a device, a pipe or the like, which
            may never end; or the path has a NUL character.
    """
    # Do not wait for the writer of a pipe. Windows has no such flag, but text files.
    flags = getattr(os, 'O_NONBLOCK', 0) | getattr(os, 'O_BINARY', 0)
    descriptor = os.open(path, os.O_RDONLY | flags)
    content = bytearray()
    try:
        mode = os.fstat(descriptor).st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # reading a folder says what it is
            raise ValueError('it is not a regular file')
        while piece := os.read(descriptor, 2**20):
            content += piece
            if len(content) > most:
                raise ValueError(f'it is larger than {most} bytes')
        return content.decode()
    finally:
        os.close(descriptor)


class Claimed(OSError):
    """A file belongs to another process; the message names it."""


class Claim:
    """An exclusive claim on a file, until it is released or our process ends."""

    def __init__(self, path: Path, owner: str) -> None:
        """Claim a file, which need not exist, by locking one beside it, which stays there; later
        claimants are told the owner.

        Raises:
            Claimed: Another claim is on it.
            OSError: The lock cannot be made.
        """
        if os.path.isdir(path):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        from fcntl import LOCK_EX, LOCK_NB, flock  # POSIX only, as is a claim

        lock = path.with_name(f'.{path.name}.lock')
        self._descriptor = os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            flock(self._descriptor, LOCK_EX | LOCK_NB)
            os.write(self._descriptor, f'{owner}\n'.encode())
        except BlockingIOError:
            text = os.read(self._descriptor, 500).decode(errors='replace')
            self.release_file()
            raise Claimed(f'{path} is in use by {text.partition(chr(10))[0]}') from None
        except BaseException:
            self.release_file()
            raise

    def release_file(self) -> None:
        """Release the file."""
        with suppress(OSError):
            os.close(self._descriptor)


def path_exists(path: Path) -> bool:
    """Return whether this path exists; False if that cannot be determined."""
    return os.path.lexists(path)


def describe_error(error: Exception) -> str:
    """Return the system's reason, for a message of our own."""
    return getattr(error, 'strerror', None) or str(error)
