"""Files that contain a digest of their content, which is checked before they are used.

What a disk, a copy or a killed process has damaged is not used: whoever needs it makes it again, over it.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from contfric.base.files import replacing
from contfric.errors import ResultFileError

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


def write_checked(path: Path, content: bytes) -> None:
    """Write a file with the digest of its content before it.

    Raises
    ------
    ResultFileError
        If it cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(fingerprint(content).encode() + content)


def read_checked(path: Path) -> bytes:
    """Return the content of a file that :func:`write_checked` wrote.

    Raises
    ------
    OSError
        If it cannot be read.
    ResultFileError
        If it is damaged.
    """
    content = path.read_bytes()
    digest, content = content[: 2 * _SIZE], content[2 * _SIZE :]
    if digest == fingerprint(content).encode():
        return content
    raise ResultFileError(f"{path} is damaged")


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
