"""Files whose content is checked before it is used: with a list of digests next to them, or a seal in them.

What a disk, a copy or a killed process has damaged is thrown away, so that whoever needs it makes it again.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from pathlib import Path

from contfric.errors import ResultFileError
from contfric.files import replacing

_LIST = "digests.json"
#: Bytes of a digest: damage by chance is missed once in 2**128 times.
_SIZE = 16
_SEAL = "# digest "


def fingerprint(content: bytes) -> str:
    """Return the digest of some bytes.

    Examples
    --------
    >>> fingerprint(b"1a") == fingerprint(b"1a") != fingerprint(b"2a")
    True
    """
    return hashlib.blake2b(content, digest_size=_SIZE).hexdigest()


def discard_damaged(folder: Path, suffixes: tuple[str, ...]) -> bool:
    """Delete the files of a folder, and those below it, unless they are as they were listed.

    Returns
    -------
    bool
        Whether files are there, and sound.

    Raises
    ------
    OSError
        If a damaged file cannot be deleted.
    """
    files = list(_files(folder, suffixes))
    if not files:
        return False
    try:
        listed = json.loads((folder / _LIST).read_text(encoding="utf-8"))
        if listed == _digests(folder, files):
            return True
    except (OSError, ValueError):  # no list, or one that is damaged itself
        pass
    discard(folder, suffixes)
    return False


def discard(folder: Path, suffixes: tuple[str, ...]) -> None:
    """Delete files and their list; folders stay, for another process may be writing to them."""
    for path in (folder / _LIST, *_files(folder, suffixes)):
        path.unlink(missing_ok=True)


def list_files(folder: Path, suffixes: tuple[str, ...]) -> None:
    """Write the list of the files that are in a folder now.

    Raises
    ------
    OSError, ResultFileError
        If it cannot be written.
    """
    text = json.dumps(_digests(folder, _files(folder, suffixes)), indent=0)
    with replacing(folder / _LIST) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _files(folder: Path, suffixes: tuple[str, ...]) -> Iterator[Path]:
    return (path for path in sorted(folder.rglob("*")) if path.suffix in suffixes)


def _digests(folder: Path, files: list[Path] | Iterator[Path]) -> dict[str, str]:
    return {path.relative_to(folder).as_posix(): fingerprint(path.read_bytes()) for path in files}


def write_sealed(path: Path, text: str) -> None:
    """Write a module with the digest of its text in the last line.

    Raises
    ------
    ResultFileError
        If it cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(f"{text}{_SEAL}{fingerprint(text.encode())}\n".encode())


def read_sealed(path: Path) -> str:
    """Return the text of a sealed module.

    Raises
    ------
    ResultFileError
        If it is missing, or not what was written.
    """
    try:
        text, seal, digest = path.read_bytes().decode().rpartition(_SEAL)
    except (OSError, UnicodeDecodeError) as error:
        raise ResultFileError(f"cannot read {path}: {error}") from None
    if not seal or digest.strip() != fingerprint(text.encode()):
        raise ResultFileError(f"{path} is damaged")
    return text
