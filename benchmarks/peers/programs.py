"""Processes of the programs that evolvent is compared with, and the environment in which these are installed."""

from __future__ import annotations

import json
import os
import pathlib
import selectors
import subprocess
import sys
import tempfile
from typing import Any

HERE = pathlib.Path(__file__).resolve().parent
VENV = HERE.parent / ".peers"
PYTHON = VENV / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
#: Time for one answer, s, and for the first, in which evolvent may compile.
PATIENCE, FIRST = 120.0, 900.0


def install(wanted: dict[str, str]) -> dict[str, str]:
    """Set the environment up; of each name that is missing, why."""
    missing: dict[str, str] = {}
    if not PYTHON.exists():
        subprocess.run([sys.executable, "-m", "venv", str(VENV)], check=True)
    for name, what in wanted.items():
        command = [str(PYTHON), "-m", "pip", "install", "-q", "--no-compile", "--disable-pip-version-check"]
        done = subprocess.run([*command, *what.split()], capture_output=True, text=True, check=False)
        if done.returncode:
            missing[name] = "it could not be installed"
            print(f"going on without {name}: it could not be installed", file=sys.stderr)
    return missing


class Program:
    """A program's process: a module of this folder, in the environment of the peers or in this one."""

    def __init__(self, module: str, *, peer: bool) -> None:
        self.module, self.peer, self.patience = module, peer, FIRST
        self.folder = tempfile.TemporaryDirectory()
        self.start()

    def start(self) -> None:
        """A fresh process, ready to answer."""
        environment = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
        python = sys.executable
        if self.peer:
            environment.pop("PYTHONPATH", None)
            python = str(PYTHON)
        self.process = subprocess.Popen(
            [python, str(HERE / "worker.py"), self.module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            cwd=self.folder.name,  # some write a log where they run
        )
        ready = self.read()
        self.version, self.missing = ready.get("version"), ready.get("missing")

    def read(self) -> dict[str, Any]:
        """One answer; a process that ends or does not answer is said to have died."""
        with selectors.DefaultSelector() as watch:
            watch.register(self.process.stdout, selectors.EVENT_READ)
            line = self.process.stdout.readline() if watch.select(self.patience) else ""
        if line:
            return json.loads(line)
        self.process.kill()
        self.process.wait()
        return {"died": True, "missing": "its process ended or did not answer"}

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """One run."""
        if self.process.poll() is not None:
            self.start()
        self.process.stdin.write(json.dumps(request) + "\n")
        self.process.stdin.flush()
        return self.read()

    def close(self) -> None:
        """End the process."""
        self.process.stdin.close()
        self.process.wait()
