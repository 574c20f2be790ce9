"""The secret of this user that signs the queue, so that no job starts that comes with a folder from elsewhere."""

from __future__ import annotations

import contextlib
import hashlib
import hmac
import json
import os
import pathlib
import secrets
import stat
import sys
from typing import Any

_FILE, _SIZE = "studio.key", 32


class Signer:
    """Signatures with one secret: HMAC with SHA-256 over JSON.

    Parameters
    ----------
    secret : bytes
    """

    def __init__(self, secret: bytes) -> None:
        self._secret = secret

    def sign(self, content: Any) -> str:
        """The signature of something that JSON can hold."""
        text = json.dumps(content, sort_keys=True, separators=(",", ":"))
        return hmac.new(self._secret, text.encode(), hashlib.sha256).hexdigest()

    def is_signed(self, content: Any, signature: object) -> bool:
        """Whether the signature is that of the content."""
        given = signature if isinstance(signature, str) else ""
        return hmac.compare_digest(self.sign(content).encode(), given.encode("utf-8", "replace"))


def of_user() -> Signer:
    """Signatures with the secret of the user, made at the first call; one of this process where it cannot be kept."""
    folder = _state_folder()
    with contextlib.suppress(OSError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        # written whole under another name first: two studios may be started at once
        temporary = folder / f".{_FILE}.{secrets.token_hex(8)}"
        descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o600)
        try:
            with open(descriptor, "wb") as file:
                file.write(secrets.token_bytes(_SIZE))
            if _read(folder / _FILE) is None:
                os.replace(temporary, folder / _FILE)
        finally:
            temporary.unlink(missing_ok=True)
    return Signer(_read(folder / _FILE) or secrets.token_bytes(_SIZE))


def _read(path: pathlib.Path) -> bytes | None:
    """The secret in a file; None where there is none, or others may read or write it."""
    flags = os.O_RDONLY | getattr(os, "O_BINARY", 0) | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    try:
        with open(os.open(path, flags), "rb") as file:
            status = os.fstat(file.fileno())
            mine = sys.platform == "win32" or (status.st_uid == os.getuid() and not status.st_mode & 0o077)
            secret = file.read(_SIZE + 1) if mine and stat.S_ISREG(status.st_mode) else b""
    except OSError:
        return None
    return secret if len(secret) == _SIZE else None


def _state_folder() -> pathlib.Path:
    """Folder for what this program keeps of the user."""
    home = pathlib.Path(os.path.expanduser("~"))
    if sys.platform == "win32":
        return pathlib.Path(os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local") / "evolvent"
    if sys.platform == "darwin":
        return home / "Library" / "Application Support" / "evolvent"
    given = os.environ.get("XDG_STATE_HOME", "")  # a relative one is to be ignored
    return (pathlib.Path(given) if os.path.isabs(given) else home / ".local" / "state") / "evolvent"
