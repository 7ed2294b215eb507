"""A disk that fails while the service runs, or before it starts, and that works again."""

import builtins
import errno
import io
import os
from contextlib import contextmanager
from pathlib import Path

WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT


@contextmanager
def failing(monkeypatch, directory, number=errno.EROFS, *, unreadable=False):
    """Whatever is written below a directory fails with this error; with ``unreadable``, read, too.

    As of a read-only file system: what is there can be opened to be read.
    """
    directory = Path(directory)

    def below(path):
        return Path(os.path.abspath(path)).is_relative_to(directory)

    def refuse():
        raise OSError(number, os.strerror(number))

    def guarded(call, *, concerned):
        def guard(*args, **kwargs):
            if concerned(*args, **kwargs):
                refuse()
            return call(*args, **kwargs)

        return guard

    def opened(path, flags, *_args, **_kwargs):
        return below(path) and bool(flags & WRITING or (unreadable and not os.path.isdir(path)))

    def opened_file(file, mode="r", *_args, **_kwargs):
        if isinstance(file, int) or not below(file):
            return False
        return unreadable or any(letter in mode for letter in "wax+")

    def written(descriptor, _data):
        return below(os.readlink(f"/proc/self/fd/{descriptor}"))

    def changed(path, *_args, **_kwargs):
        return below(path)

    def made(path, *_args, **_kwargs):
        return below(path) and not os.path.exists(path)

    with monkeypatch.context() as patch:
        patch.setattr(os, "open", guarded(os.open, concerned=opened))
        patch.setattr(os, "write", guarded(os.write, concerned=written))
        patch.setattr(os, "mkdir", guarded(os.mkdir, concerned=made))
        for name in ("unlink", "rename", "replace"):
            patch.setattr(os, name, guarded(getattr(os, name), concerned=changed))
        for module in (io, builtins):
            patch.setattr(module, "open", guarded(module.open, concerned=opened_file))
        yield
