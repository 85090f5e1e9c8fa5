"""Files that appear whole or not at all."""

import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mpcam.errors import InputError


@contextmanager
def atomic_path(path) -> Iterator[Path]:
    """A temporary name in the folder of `path`, with the same suffix; renamed to `path` when the block ends.

    If the block raises, the temporary file is removed and an older file at `path` stays as it was. A link is followed,
    so that the file it points to is replaced. Raises InputError if the folder does not exist or `path` is a folder, and
    if the operating system refuses to write there.
    """
    try:
        target = Path(path).resolve()
        is_folder, has_parent = target.is_dir(), target.parent.is_dir()
    except (OSError, ValueError) as error:  # a name too long, without permission, or with a zero byte
        raise InputError(f"{path}: cannot be written ({error}): write somewhere else") from None
    if is_folder:
        raise InputError(f"{path}: this is a folder: give the name of a file in it")
    if not has_parent:
        raise InputError(f"{path}: the folder {target.parent} does not exist: create it first")
    # a hidden name, as short as can be: the target's own name may already be as long as the file system allows
    temporary = target.with_name(f".{secrets.token_hex(8)}{target.suffix}")
    try:
        yield temporary
        temporary.replace(target)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error}): write somewhere else") from None
    finally:
        temporary.unlink(missing_ok=True)
