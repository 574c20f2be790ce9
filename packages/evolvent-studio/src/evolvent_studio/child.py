"""Processes of the studio's own: each sends messages to the studio, one JSON object a line.

``python -P -m evolvent_studio.child MODULE`` prepares such a process before it loads libraries, and calls `main` of a
module of the studio.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from typing import IO, Any, Protocol

from evolvent_base import startup


class Process(Protocol):
    """What a process can be asked, of `subprocess.Popen` with texts."""

    stdin: IO[str] | None
    stdout: IO[str] | None
    stderr: IO[str] | None
    returncode: Any

    def poll(self) -> int | None:
        """Exit code; None while it runs."""

    def wait(self, timeout: float | None = None) -> int:
        """Exit code, when it has ended."""

    def kill(self) -> None:
        """End it at once."""


def command(module: str, *arguments: str | os.PathLike[str]) -> list[str | os.PathLike[str]]:
    """The command line of a process that calls `main` of a module of the studio with arguments."""
    return [sys.executable, "-P", "-m", __name__, module, *arguments]


def start(
    module: str, *arguments: str | os.PathLike[str], folder: str | os.PathLike[str], stderr: Any
) -> subprocess.Popen[str]:
    """Start a module of the studio in an empty folder, from which no module and no settings are picked up."""
    return subprocess.Popen(
        command(module, *arguments),
        cwd=folder,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=stderr,
        text=True,
        encoding="utf-8",
        errors="replace",
        start_new_session=os.name != "nt",  # Ctrl-C at the studio's terminal is the studio's alone
    )


def close(process: Process) -> None:
    """Close the pipes of a process that has ended."""
    for pipe in (process.stdin, process.stdout, process.stderr):
        with contextlib.suppress(OSError):
            if pipe is not None:
                pipe.close()


def channel() -> Callable[..., None]:
    """What sends a message, its items as keywords, from this process; whatever else is printed goes to stderr."""
    out = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)

    def send(**what: Any) -> None:
        out.write(json.dumps(what) + "\n")
        out.flush()

    return send


def main(module: str, *arguments: str) -> int:
    """Call `main` of a module of the studio; libraries that it has no use for are not loaded."""
    startup.prepare_process()
    with startup.array_libraries_hidden():
        code: int = importlib.import_module(f"evolvent_studio.{module}").main(*arguments)
    return code


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
