"""Files that are replaced as a whole: neither a reader nor a crash meets half of one."""

from __future__ import annotations

import contextlib
import os
import secrets

from ..scene.parameter_file import check_path, format_path


def write(path: str | os.PathLike[str], data: bytes) -> None:
    """
    Write a file, or replace one, at once.

    The bytes are written to a temporary file in the same folder, which then takes the place of the
    file.  A kill meanwhile may leave the temporary file, ``.NAME.….tmp``.

    Raises
    ------
    ValueError
        The path is none, or that of a folder, a pipe or a device.
    OSError
        The file cannot be written; one that is there stays as it is.

    """
    check_path(path)
    # What a symbolic link points to is replaced, not the link.
    target = os.path.realpath(path)
    if os.path.exists(target) and not os.path.isfile(target):
        raise ValueError(
            f'{format_path(path)}: this is not a regular file but a folder, a pipe or a device; '
            'give a file'
        )
    folder, name = os.path.split(target)
    temporary = os.path.join(folder, f'.{name}.{secrets.token_hex(4)}.tmp')
    try:
        try:
            with open(temporary, 'xb') as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, target)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(temporary)
            raise
        _sync(folder)
    except OSError as error:
        # The user knows the file, not the temporary one.
        raise type(error)(error.errno, error.strerror, os.fspath(path)) from None


def _sync(folder: str) -> None:
    """Make the names in a folder survive a loss of power."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
