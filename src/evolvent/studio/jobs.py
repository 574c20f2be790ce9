"""The queue: jobs that run one after another in processes of their own, and are still there after a restart."""

from __future__ import annotations

import contextlib
import dataclasses
import datetime
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Mapping
from typing import Any

from evolvent.errors import InputError
from evolvent.studies.store import locked
from evolvent.studio.folder import Folder
from evolvent.studio.worker import CASE, CERTIFICATE, JOB, MODES, RUN, STUDY

#: Seconds that a cancelled job has to keep what it computed.
GRACE = 8.0
#: Seconds over which the speed is taken that the time left follows from.
_WINDOW = 15.0
#: Letters of a job's name, at most.
_LONGEST_TITLE = 80
#: States of a job that is still to end.
OPEN = ("waiting", "running")
#: Kinds of jobs that compute a case, and what they are called.
COMPUTED = {"run": "Run", "equilibrium": "Equilibrium", "modes": "Modes"}
#: File or folder of the results, by kind of job.
RESULTS = {"run": RUN, "equilibrium": RUN, "modes": MODES, "sweep": STUDY, "identify": CERTIFICATE}


@dataclasses.dataclass
class Job:
    """One piece of work.

    Attributes
    ----------
    key : str, name of its folder
    kind : "run", "equilibrium", "modes", "sweep" or "identify"
    title : str
    status : "waiting", "running", "cancelling", or how it ended: "success", "stopped by event", "interrupted", "failed"
    message : str
    note : str, what it does before it can tell how far it is
    reached, end : float, s or cases
    elapsed : float, s, that it took or takes
    extra : when it was added ("date"), and what a job of its kind has: the case that it is a change of and what
        differs, signals, head and rows of a table, warnings, modes
    """

    key: str
    kind: str
    title: str
    status: str = "waiting"
    message: str = ""
    note: str = ""
    reached: float = 0.0
    end: float = 0.0
    elapsed: float = 0.0
    extra: dict[str, Any] = dataclasses.field(default_factory=dict)
    marks: deque[tuple[float, float]] = dataclasses.field(default_factory=deque, repr=False)

    @property
    def open(self) -> bool:
        """Whether it is still to end."""
        return self.status in (*OPEN, "cancelling")

    @property
    def share(self) -> float:
        """How far it is, from 0 to 1."""
        return min(max(self.reached / self.end, 0.0), 1.0) if self.end > 0.0 else 0.0

    @property
    def left(self) -> float | None:
        """Seconds that it will still take at its speed of late; None while nothing is known."""
        if len(self.marks) < 2:
            return None
        (t0, x0), (t1, x1) = self.marks[0], self.marks[-1]
        return (self.end - x1) * (t1 - t0) / (x1 - x0) if x1 > x0 and t1 - t0 > 0.3 else None

    def mark(self, reached: float, end: float) -> None:
        """Note how far it is now."""
        now = time.monotonic()
        self.reached, self.end, self.note = reached, end, ""
        self.marks.append((now, reached))
        while len(self.marks) > 2 and now - self.marks[0][0] > _WINDOW:
            self.marks.popleft()

    def content(self) -> dict[str, Any]:
        """What is kept of it."""
        names = ("key", "kind", "title", "status", "message", "reached", "end", "elapsed", "extra")
        return {name: getattr(self, name) for name in names}


class Jobs:
    """The queue of a working folder.

    Parameters
    ----------
    folder : Folder

    Raises
    ------
    InputError
        If another studio works in the folder.
    """

    def __init__(self, folder: Folder) -> None:
        self.folder = folder
        self._lock = threading.RLock()
        self._wake = threading.Condition(self._lock)
        self._process: subprocess.Popen[str] | None = None
        self._stopped = False
        self._held = contextlib.ExitStack()
        self._held.enter_context(locked(folder.own))
        self.version = 0  # grows with every change that a page shows
        self.jobs: dict[str, Job] = {}
        self._load()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    # -------------------------------------------------------------------------------------------- what a page asks

    def place(self, key: str) -> pathlib.Path:
        """Folder of a job."""
        return self.folder.own / key

    def get(self, key: str) -> Job:
        """A job.

        Raises
        ------
        InputError
            If there is none of that name.
        """
        if key not in self.jobs:
            raise InputError(f"no run is called {key!r}")
        return self.jobs[key]

    def listed(self) -> list[Job]:
        """All jobs, the newest first."""
        with self._lock:
            return list(reversed(self.jobs.values()))

    def add(self, kind: str, title: str, *, case: str = "", extra: Mapping[str, Any] | None = None) -> Job:
        """Put a job at the end of the queue.

        Parameters
        ----------
        case : str, its case, study or description as YAML
        """
        with self._lock:
            last = max((int(key[:4]) for key in self.jobs), default=0)
            word = re.sub(r"[^\w-]", "-", title)[:40].strip("-") or kind
            date = datetime.datetime.now().astimezone().isoformat(timespec="seconds")
            job = Job(key=f"{last + 1:04d}-{word}", kind=kind, title=title, extra={"date": date, **(extra or {})})
            place = self.place(job.key)
            shutil.rmtree(place, ignore_errors=True)
            place.mkdir()
            (place / CASE).write_text(case, encoding="utf-8")
            content = {"kind": kind, **job.extra}
            (place / JOB).write_text(json.dumps(content), encoding="utf-8")
            self.jobs[job.key] = job
            self._changed()
            self._wake.notify_all()
            return job

    def cancel(self, key: str) -> None:
        """End a job; what was computed is kept."""
        with self._lock:
            job = self.get(key)
            if job.status == "waiting":
                job.status, job.message = "interrupted", "cancelled before it began"
            elif job.status == "running":
                job.status = "cancelling"
                if self._process is not None:  # else it is about to start, and is told then
                    _stop(self._process)
            self._changed()

    def go_on(self, key: str) -> None:
        """Put a study that was cancelled back into the queue; cases that are done are not computed again."""
        with self._lock:
            job = self.get(key)
            if job.kind != "sweep" or job.open or job.status == "success":
                raise InputError(f"{key} is no study that was cancelled")
            job.status, job.message = "waiting", ""
            job.marks.clear()
            self._changed()
            self._wake.notify_all()

    def rename(self, key: str, title: str) -> None:
        """Give a job another name.

        Raises
        ------
        InputError
            If the name is empty or too long.
        """
        title = " ".join(title.split())
        if not 0 < len(title) <= _LONGEST_TITLE:
            raise InputError(f"the name has {len(title)} letters; it must have 1 to {_LONGEST_TITLE}")
        with self._lock:
            self.get(key).title = title
            self._changed()

    def remove(self, key: str) -> None:
        """Forget a job that has ended, with its files."""
        with self._lock:
            if self.get(key).open:
                raise InputError(f"{key} has not ended; cancel it first")
            del self.jobs[key]
            shutil.rmtree(self.place(key), ignore_errors=True)
            self._changed()

    def result(self, key: str) -> pathlib.Path | None:
        """File or folder of a job's results, None while there are none."""
        name = RESULTS[self.get(key).kind]
        path = self.place(key) / name
        whole = path / "results.zarr" if name == STUDY else path
        return path if whole.exists() else None

    def stop(self) -> None:
        """End the work for now; what is open goes on when the studio is started again."""
        with self._lock:
            self._stopped = True
            process = self._process
            self._wake.notify_all()
        if process is not None:
            with contextlib.suppress(OSError, ValueError):
                assert process.stdin is not None
                process.stdin.close()
            _end(process)
        self._thread.join(timeout=GRACE)
        self._held.close()

    # -------------------------------------------------------------------------------------------- work

    def _work(self) -> None:
        while True:
            with self._lock:
                job = next((job for job in self.jobs.values() if job.status == "waiting"), None)
                if self._stopped:
                    return
                if job is None:
                    self._wake.wait()
                    continue
                job.status = "running"
                self._changed()
            try:
                self._compute(job)
            except OSError as error:
                job.status, job.message = "failed", f"no process could be started: {error}"
            with self._lock:
                self._process = None
                self._changed()

    def _compute(self, job: Job) -> None:
        began = time.monotonic()
        job.note = "starting"
        place = self.place(job.key)
        with (place / "log.txt").open("w", encoding="utf-8") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", "evolvent.studio.worker", os.fspath(place)],
                cwd=self.folder.root,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                encoding="utf-8",
                start_new_session=os.name != "nt",  # Ctrl-C at the studio's terminal is the studio's alone
            )
            with self._lock:
                self._process = process
                if job.status == "cancelling" or self._stopped:
                    _stop(process)
            assert process.stdout is not None
            ended: dict[str, Any] = {}
            for line in process.stdout:
                try:
                    message = json.loads(line)
                except ValueError:
                    continue
                job.elapsed = time.monotonic() - began
                if "reached" in message:
                    job.mark(message["reached"], message["end"])
                elif "note" in message:
                    job.note = message["note"]
                elif "status" in message:
                    ended = message
                else:
                    job.extra |= message
                self.version += 1
            process.wait()
            for pipe in (process.stdin, process.stdout):
                with contextlib.suppress(OSError):
                    if pipe is not None:
                        pipe.close()
        with self._lock:
            job.elapsed, job.note = time.monotonic() - began, ""
            if self._stopped and not ended.get("status", "interrupted").startswith(("success", "stopped", "failed")):
                job.status = "waiting"  # it goes on, or begins again, when the studio is started again
                return
            if ended:
                job.status, job.message = ended["status"], ended["message"]
            elif job.status == "cancelling":
                job.status, job.message = "interrupted", "cancelled; nothing had been computed yet"
            else:
                job.status, job.message = "failed", _last_line(place / "log.txt")

    # -------------------------------------------------------------------------------------------- kept

    def _changed(self) -> None:
        self.version += 1
        path = self.folder.own / "queue.json"
        temporary = path.with_suffix(".part")
        content = json.dumps([job.content() for job in self.jobs.values()], indent=1)
        with contextlib.suppress(OSError):
            temporary.write_text(content, encoding="utf-8")
            os.replace(temporary, path)

    def _load(self) -> None:
        path = self.folder.root / ".evolvent-studio" / "queue.json"
        try:
            kept = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else []
            jobs = [Job(**content) for content in kept]
        except (OSError, ValueError, TypeError):
            return
        for job in jobs:
            if re.fullmatch(r"\d{4}-[\w-]+", job.key) and self.place(job.key).is_dir():
                if job.status in ("running", "cancelling"):  # the studio was killed meanwhile
                    job.status = "waiting"
                self.jobs[job.key] = job


def _stop(process: subprocess.Popen[str]) -> None:
    """Ask a process to end, and see to it that it does."""
    with contextlib.suppress(OSError, ValueError):
        assert process.stdin is not None
        process.stdin.write("stop\n")
        process.stdin.flush()
    threading.Thread(target=_end, args=(process,), daemon=True).start()


def _end(process: subprocess.Popen[str]) -> None:
    """Give a process time to keep what it computed, then end it."""
    try:
        process.wait(timeout=GRACE)
    except subprocess.TimeoutExpired:
        process.kill()


def _last_line(path: pathlib.Path) -> str:
    lines = path.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    return f"its process died: {lines[-1]}" if lines else "its process died"
