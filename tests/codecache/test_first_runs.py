"""First runs: several at once compile each function once, and what is kept serves under every option of Python."""

from __future__ import annotations

import os
import pathlib
import signal
import subprocess
import sys
import time

import pytest
from numba import config

from evolvent.compiled.codecache import folder
from evolvent_base import locks

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(bool(config.DISABLE_JIT), reason="nothing is compiled under NUMBA_DISABLE_JIT"),
]

#: Loads a few functions of the package and a law, and prints what was compiled here and in the process beside.
SCRIPT = """
import os, sys
from evolvent.compiled import compilers, jit, laws
from evolvent.compiled.codecache import compiled
save, own = compiled._Store.save_overload, []
def counted(self, *given):
    own.append(self._name)
    save(self, *given)
compiled._Store.save_overload = counted
jit._compile_aside = lambda functions: None
from evolvent.kernels import rigid
@laws.law
def force(x, v, t, p):
    '''A law.'''
    return -2.0 * x[0], 0.0, 0.0
force.of("force")
jit.load([one for one in jit.functions() if one.py_func.__module__ == rigid.__name__][:2])
print(*sorted(name for name in own), sep="\\n")
"""


def started(place: pathlib.Path, **environment: str) -> subprocess.Popen[str]:
    script = place / "first_run.py"
    script.write_text(SCRIPT)
    names = {**os.environ, folder.VARIABLE: str(place / "cache"), **environment}
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, str(script)], stdout=pipe, stderr=pipe, text=True, env=names)


def compiled_by(process: subprocess.Popen[str]) -> list[str]:
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    return out.split()


def test_runs_that_start_at_once_compile_each_function_once(tmp_path) -> None:
    processes = [started(tmp_path) for _ in range(3)]
    compiled = [name for process in processes for name in compiled_by(process)]
    assert len(compiled) == len(set(compiled)) >= 3
    for more in ({"PYTHONOPTIMIZE": "1"}, {"PYTHONOPTIMIZE": "2"}):
        assert compiled_by(started(tmp_path, **more)) == []


def held(path: pathlib.Path) -> subprocess.Popen[str]:
    """A process that holds the lock of a file."""
    script = (
        "import pathlib, sys, time; from evolvent_base import locks\n"
        "with locks.turn(pathlib.Path(sys.argv[1]), lambda: True): print('has it', flush=True); time.sleep(60)"
    )
    process = subprocess.Popen([sys.executable, "-c", script, str(path)], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "has it\n"
    return process


def test_a_turn_is_waited_for_no_longer_than_is_of_use(tmp_path, monkeypatch) -> None:
    path = tmp_path / "turn.lock"
    process = held(path)
    try:
        asked: list[float] = []

        def is_needed() -> bool:  # until the third look
            asked.append(time.monotonic())
            return len(asked) < 3

        with locks.turn(path, is_needed):
            assert len(asked) == 3
        monkeypatch.setattr(locks, "STALE", 0.5)  # the holder gives no sign of life
        began = time.monotonic()
        with locks.turn(path, lambda: True):
            assert time.monotonic() - began >= 0.5
        process.send_signal(signal.SIGTERM)
        process.wait()
        monkeypatch.setattr(locks, "STALE", 1e9)
        with locks.turn(path, lambda: True):  # which ended with its holder
            pass
    finally:
        process.kill()
        process.communicate()


def test_where_files_cannot_be_locked_nobody_is_waited_for(tmp_path, monkeypatch) -> None:
    def refused(file: object) -> bool:
        raise OSError("not supported")

    monkeypatch.setattr(locks, "is_locked_now", refused)
    with locks.turn(tmp_path / "turn.lock", lambda: True) as live:
        live()
    with locks.turn(pathlib.Path(os.devnull) / "turn.lock", lambda: True) as live:
        live()
