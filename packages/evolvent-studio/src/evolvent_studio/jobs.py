"""The queue: jobs that run one after another in processes of their own, and are still there after a restart.

The queue is kept in the working folder, which may come from elsewhere. Each job is signed with a secret of the user,
over its content, its case and the path of the folder; a job without that signature is listed, but never started.
"""

from __future__ import annotations

import contextlib
import datetime
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Mapping
from typing import Any

from evolvent_base.errors import InputError
from evolvent_studio import child, signing, warm
from evolvent_studio.folder import OWN, Folder
from evolvent_studio.job import FOREIGN, KEPT, Job, kept_job
from evolvent_studio.jobkinds import CASE
from evolvent_studio.places import LARGEST_RECORDING
from evolvent_studio.worker import parsed

#: Seconds that a cancelled job has to keep what it computed.
GRACE = 8.0
#: Files of the queue and of what a job's process printed; largest queue, case and print that are read, bytes.
_QUEUE, _LOG, _LARGEST = "queue.json", "log.txt", 16_000_000
#: Letters of a job's name, at most.
LONGEST_TITLE = 80


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
        self._process: child.Process | None = None
        self._stopped = False
        self._held = contextlib.ExitStack()
        self._held.enter_context(folder.locked())
        self._signer = signing.of_user()
        self.version = 0  # grows with every change that a page shows
        self.jobs: dict[str, Job] = {}
        self.note = ""  # why the queue that the folder holds is left out, '' where it is not
        try:
            self._load()
        except InputError as error:
            self.note = f"the queue of the folder is left out: {error}"
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    # -------------------------------------------------------------------------------------------- what a page asks

    def folder_of(self, key: str) -> pathlib.Path:
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
            word = re.sub(r"[^A-Za-z0-9_-]", "-", title)[:40].strip("-") or kind
            date = datetime.datetime.now().astimezone().isoformat(timespec="seconds")
            digest = hashlib.sha256(case.encode()).hexdigest()
            key = f"{self._number():04d}-{word}"
            job = Job(key=key, kind=kind, title=title, extra={"date": date, **(extra or {})}, digest=digest)
            self.folder.make(OWN, key)
            self.folder.write(OWN, key, CASE, content=case.encode())
            self.jobs[job.key] = job
            self._changed()
            self._wake.notify_all()
            return job

    def _number(self) -> int:
        """A number that no job and no folder of one has; the largest of them and one, as long as it has four digits."""
        names = (*self.jobs, *os.listdir(self.folder.own))
        taken = {int(name[:4]) for name in names if re.match(r"[0-9]{4}-", name)}
        number = max(taken, default=0) + 1
        if number > 9999:
            number = next((n for n in range(1, 10_000) if n not in taken), 0)
        if not number:
            raise InputError("the folder holds 9999 runs; remove some of them")
        return number

    def case(self, key: str) -> dict[str, Any]:
        """The case, study or description of a job.

        Raises
        ------
        InputError
            If there is no such job, or its file cannot be read.
        """
        return parsed(self.case_text(key), CASE)

    def case_text(self, key: str) -> str:
        """The case, study or description of a job, as YAML.

        Raises
        ------
        InputError
            If there is no such job, or its file cannot be read.
        """
        job = self.get(key)
        try:
            return self.folder.read(OWN, job.key, CASE, most=_LARGEST).decode()
        except UnicodeDecodeError:
            raise InputError(f"the case of {job.key} is not UTF-8 text") from None

    def cancel(self, key: str) -> None:
        """End a job; what was computed is kept."""
        with self._lock:
            job = self.get(key)
            if job.status == "waiting":
                job.status, job.message = "interrupted", "cancelled before it began"
            elif job.status == "running":
                job.status = "cancelling"
                if self._process is not None:  # else it is about to start, and is cancelled then
                    _stop(self._process)
            self._changed()

    def resume(self, key: str) -> None:
        """Put a job that was cancelled back into the queue, which goes on where it was, such as a study."""
        with self._lock:
            job = self.get(key)
            if not job.sort.resumed or job.open or job.status == "success":
                raise InputError(f"{key} is nothing that was cancelled and can go on, such as a study")
            if not job.own:
                raise InputError(f"{key} was {FOREIGN}, and is not started; run it yourself")
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
        if not 0 < len(title) <= LONGEST_TITLE:
            raise InputError(f"the name has {len(title)} letters; it must have 1 to {LONGEST_TITLE}")
        with self._lock:
            self.get(key).title = title
            self._changed()

    def remove(self, key: str) -> None:
        """Forget a job that has ended, with its files."""
        with self._lock:
            if self.get(key).open:
                raise InputError(f"{key} has not ended; cancel it first")
            del self.jobs[key]
            shutil.rmtree(self.folder_of(key), ignore_errors=True)
            self._changed()

    def result(self, key: str) -> pathlib.Path | None:
        """File or folder of a job's results, None while there are none."""
        sort = self.get(key).sort
        whole = self.folder.existing(OWN, key, sort.result, *filter(None, [sort.last]))
        return self.folder.existing(OWN, key, sort.result) if whole is not None else None

    def report(self, key: str) -> pathlib.Path | None:
        """The page with a job's results, None where there is none."""
        place = self.get(key).sort.report
        return self.folder.existing(OWN, key, *place) if place else None

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
            except InputError as error:
                job.status, job.message = "failed", str(error)
            with self._lock:
                self._process = None
                self._changed()

    def _compute(self, job: Job) -> None:
        began = time.monotonic()
        job.note = "starting"
        place = self.folder_of(job.key)
        text = self.case_text(job.key)
        if hashlib.sha256(text.encode()).hexdigest() != job.digest:
            raise InputError("its case was changed after it was queued; run the case again")
        self.folder.check_plain(place)  # results are written there
        for name in job.extra.get("signals", ()):
            self.folder.file(name, LARGEST_RECORDING)
        asked = {"kind": job.kind, "case": text, "signals": job.extra.get("signals", [])}
        with (
            self.folder.create(OWN, job.key, _LOG) as log,
            tempfile.TemporaryDirectory(prefix="evolvent-job-") as empty,
        ):
            process = warm.start("worker", place, folder=empty, stderr=log)
            assert process.stdin is not None
            with contextlib.suppress(OSError):  # it died at once; what it printed says why
                process.stdin.write(json.dumps(asked) + "\n")
                process.stdin.flush()
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
            child.close(process)
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
                job.status, job.message = "failed", self._last_line(job)

    # -------------------------------------------------------------------------------------------- kept

    def _changed(self) -> None:
        self.version += 1
        listed = [job.content() | {"signature": self._signature(job)} for job in self.jobs.values()]
        with contextlib.suppress(OSError, InputError):
            self.folder.write(OWN, _QUEUE, content=json.dumps(listed, indent=1).encode())

    def _signature(self, job: Job) -> str:
        """The signature of a job of this installation, '' for one of another."""
        return self._signer.sign(self._signed(job.content())) if job.own else ""

    def _signed(self, content: Mapping[str, Any]) -> list[Any]:
        """What is signed of a job."""
        return [os.fspath(self.folder.root), {name: content.get(name) for name in KEPT}]

    def _load(self) -> None:
        """Take the jobs of the queue's file.

        Raises
        ------
        InputError
            If the file is a link, is too large, or holds no list.
        """
        if not os.path.lexists(self.folder.own / _QUEUE):
            return
        try:
            listed = json.loads(self.folder.read(OWN, _QUEUE, most=_LARGEST))
        except (ValueError, RecursionError):
            raise InputError(f"'{OWN}/{_QUEUE}' is not JSON") from None
        if not isinstance(listed, list):
            raise InputError(f"'{OWN}/{_QUEUE}' holds no list")
        for content in listed:
            if not isinstance(content, dict):
                continue
            try:
                own = self._signer.is_signed(self._signed(content), content.get("signature"))
                job = kept_job(content, own=own)
            except RecursionError:
                continue
            if job is not None and self.folder.existing(OWN, job.key) is not None:
                self.jobs[job.key] = job

    def _last_line(self, job: Job) -> str:
        """Why a process died, by what it printed last."""
        try:
            with self.folder.opened(OWN, job.key, _LOG) as file:
                file.seek(max(file.seek(0, os.SEEK_END) - 4000, 0))
                lines = file.read(4000).decode("utf-8", "replace").strip().splitlines()
        except InputError:
            lines = []
        return f"its process died: {lines[-1]}" if lines else "its process died"


def _stop(process: child.Process) -> None:
    """Ask a process to end, and see to it that it does."""
    with contextlib.suppress(OSError, ValueError):
        assert process.stdin is not None
        process.stdin.write("stop\n")
        process.stdin.flush()
    threading.Thread(target=_end, args=(process,), daemon=True).start()


def _end(process: child.Process) -> None:
    """Give a process time to keep what it computed, then end it."""
    try:
        process.wait(timeout=GRACE)
    except subprocess.TimeoutExpired:
        process.kill()
