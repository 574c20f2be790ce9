"""A process that has loaded the libraries: the studio's processes are forks of it, and start without loading them.

It serves where a process can be forked safely: on Linux, while it has one thread. Elsewhere, until it has loaded, and
when it is gone, each process loads for itself (`child.start`).

A fork has a parent that keeps its number until the studio knows how it has ended: no other process is ended in its
place.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import gc
import importlib
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from typing import IO, Any, NoReturn

from evolvent_base import startup
from evolvent_studio import child

#: What forks have loaded: modules with a `main`, and what nearly all of their work needs.
LOADED = ("worker", "exporter")
SYSTEM = "structure"
#: Bytes of the length of a message; seconds in which a process that has loaded forks.
_LENGTH, _FORKING = 8, 10.0


class Forked:
    """A fork, as `child.Process`.

    Parameters
    ----------
    keeper : socket of the fork's parent, which sends its number and, when it has ended, its exit code
    stdin, stdout, stderr : ends of its pipes; None for what is no pipe
    """

    def __init__(self, keeper: socket.socket, stdin: IO[str], stdout: IO[str], stderr: IO[str] | None) -> None:
        self.stdin: IO[str] | None = stdin
        self.stdout: IO[str] | None = stdout
        self.stderr = stderr
        self.returncode: int | None = None
        self._keeper, self._lock, self._ended = keeper, threading.Lock(), threading.Event()
        keeper.settimeout(_FORKING)
        self._lines = keeper.makefile("rb")
        self.pid = int(self._lines.readline() or 0)
        if not self.pid:
            raise ConnectionError("no process was forked")
        keeper.settimeout(None)
        threading.Thread(target=self._follow, daemon=True).start()

    def _follow(self) -> None:
        """Wait for its end."""
        with contextlib.suppress(OSError):
            code = self._lines.readline()
        with self._lock:
            self.returncode = int(code) if code else -int(signal.SIGKILL)
            self._lines.close()
            self._keeper.close()  # its parent forgets its number
        self._ended.set()

    def poll(self) -> int | None:
        """Exit code; None while it runs."""
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Exit code, when it has ended.

        Raises
        ------
        subprocess.TimeoutExpired
        """
        if not self._ended.wait(timeout):
            raise subprocess.TimeoutExpired("evolvent_studio", timeout or 0.0)
        assert self.returncode is not None
        return self.returncode

    def kill(self) -> None:
        """End it at once."""
        with self._lock:
            if self.returncode is None:
                os.kill(self.pid, signal.SIGKILL)


class Server:
    """The process, as the studio sees it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._control: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._ready = False
        self._empty = contextlib.ExitStack()

    def begin(self) -> None:
        """Start it where it can serve; it loads beside what else is done."""
        if sys.platform != "linux" or self._process is not None:
            return
        empty = self._empty.enter_context(tempfile.TemporaryDirectory(prefix="evolvent-warm-"))
        self._control, other = socket.socketpair()
        with other, contextlib.suppress(OSError):
            self._process = subprocess.Popen(
                child.command("warm"), cwd=empty, stdin=other.fileno(), stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL, start_new_session=True,
            )  # fmt: skip

    def is_ready(self) -> bool:
        """Whether it has loaded, and is there."""
        if self._process is None or self._process.poll() is not None or self._control is None:
            return False
        if not self._ready:
            with contextlib.suppress(OSError):
                self._ready = self._control.recv(1, socket.MSG_DONTWAIT) == b"r"
        return self._ready

    def fork(
        self, module: str, *arguments: str | os.PathLike[str], folder: str | os.PathLike[str], stderr: Any
    ) -> Forked | None:
        """A fork that does what `child.start` starts a process for; None where it cannot be had."""
        with self._lock, contextlib.ExitStack() as pipes:
            if not self.is_ready():
                return None
            ours: dict[str, IO[str]] = {}
            given: list[int] = []

            def pipe(name: str) -> None:
                ends = os.pipe()
                pipes.callback(os.close, ends[name != "stdin"])
                given.append(ends[name != "stdin"])
                mode = "w" if name == "stdin" else "r"
                ours[name] = open(ends[name == "stdin"], mode, encoding="utf-8", errors="replace")  # noqa: SIM115

            pipe("stdin")
            pipe("stdout")
            if stderr == subprocess.PIPE:
                pipe("stderr")
            else:
                given.append(stderr.fileno())
            here, there = socket.socketpair()
            pipes.callback(there.close)
            asked = {
                "module": module, "arguments": [os.fspath(one) for one in arguments], "folder": os.fspath(folder),
                "environment": dict(os.environ),
            }  # fmt: skip
            content = json.dumps(asked).encode()
            try:
                assert self._control is not None
                socket.send_fds(self._control, [len(content).to_bytes(_LENGTH, "big")], [*given, there.fileno()])
                self._control.sendall(content)
                there.close()
                return Forked(here, ours["stdin"], ours["stdout"], ours.get("stderr"))
            except (OSError, ValueError):
                here.close()
                for file in ours.values():
                    file.close()  # which ends what may have been forked all the same
                self._end()
                return None

    def end(self) -> None:
        """End it; its forks go on."""
        with self._lock:
            self._end()

    def _end(self) -> None:
        process, control = self._process, self._control
        self._process, self._control, self._ready = None, None, False
        if control is not None:
            control.close()
        if process is not None:
            process.kill()
            process.wait()
        self._empty.close()


@functools.cache
def server() -> Server:
    """The one of this studio; it ends with this process."""
    found = Server()
    atexit.register(found.end)
    return found


def start(
    module: str, *arguments: str | os.PathLike[str], folder: str | os.PathLike[str], stderr: Any
) -> child.Process:
    """Start a module of the studio as `child.start`, without loading the libraries where that has been done."""
    found = server().fork(module, *arguments, folder=folder, stderr=stderr)
    return child.start(module, *arguments, folder=folder, stderr=stderr) if found is None else found


# ------------------------------------------------------------------------------------------------ the process


def main() -> int:
    """Load the libraries, then fork a process for each message, until the socket on stdin closes."""
    control = socket.socket(fileno=os.dup(0))
    os.dup2(1, 0)
    for name in LOADED:
        importlib.import_module(f"evolvent_studio.{name}")
    importlib.import_module("evolvent.cases").system(SYSTEM)
    [*importlib.import_module("evolvent.parts.registry").kinds().values()]  # loads all modules of parts
    importlib.import_module("evolvent.analysis.margins.evaluation")
    startup.load_drawing()
    if len(os.listdir("/proc/self/task")) > 1:  # a fork has one thread, and what others hold is held for ever
        return 1
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # parents of forks leave nothing behind
    gc.collect()
    gc.freeze()
    with contextlib.suppress(OSError):
        control.sendall(b"r")
    while True:
        asked, descriptors = _next(control)
        if asked is None:
            os._exit(0)
        if os.fork() == 0:
            control.close()
            return _forked(asked, *descriptors)
        for one in descriptors:
            os.close(one)


def _next(control: socket.socket) -> tuple[dict[str, Any] | None, list[int]]:
    """What is asked, with descriptors of its pipes and of the socket of its parent; None where the studio is gone."""
    try:
        head, descriptors, _, _ = socket.recv_fds(control, _LENGTH, 4)
        length, content = int.from_bytes(head, "big"), bytearray()
        while head and len(content) < length:
            content += (part := control.recv(length - len(content)))
            if not part:
                return None, descriptors
    except OSError:
        return None, []
    return (json.loads(content) if head else None), descriptors


def _forked(asked: dict[str, Any], stdin: int, stdout: int, stderr: int, keeper: int) -> int:
    """Fork once more: the fork does what is asked, and this process keeps it."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    number = os.fork()
    if number:
        for one in (stdin, stdout, stderr):
            os.close(one)
        _keep(number, socket.socket(fileno=keeper))
    os.close(keeper)
    os.setsid()
    for one, at in ((stdin, 0), (stdout, 1), (stderr, 2)):
        os.dup2(one, at)
        os.close(one)
    os.environ.clear()
    os.environ.update(asked["environment"])
    os.chdir(asked["folder"])
    return child.main(asked["module"], *asked["arguments"])


def _keep(number: int, keeper: socket.socket) -> NoReturn:
    """Tell the number of a process, then its exit code; it is not free for others before that is known."""
    with contextlib.suppress(OSError):
        keeper.sendall(f"{number}\n".encode())
        found = os.waitid(os.P_PID, number, os.WEXITED | os.WNOWAIT)
        code = 1 if found is None else found.si_status if found.si_code == os.CLD_EXITED else -found.si_status
        keeper.sendall(f"{code}\n".encode())
        keeper.recv(1)
    os._exit(0)
