"""Processes of the studio as forks of one that has loaded the libraries: what they do, and how they end."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from evolvent import results
from evolvent_studio import child, warm
from evolvent_studio.folder import Folder
from evolvent_studio.jobs import Jobs

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="forks are made on Linux alone")]

BRIEF = """\
system: structure
gravity: [0, 0, -10]
parts: {ball: {kind: point, mass: 1 kg}}
simulate: {until: 1 s, every: 0.1 s}
"""
LONG = BRIEF.replace("1 s, every: 0.1 s", "1e6 s, every: 10 s, method: rk4, step: 1e-3 s")


def until(condition, seconds=60.0):
    """Wait for something."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it took too long"
        time.sleep(0.02)


@pytest.fixture
def server():
    """The server of this process, which has loaded."""
    found = warm.server()
    if not found.is_ready():
        found.end()
        found.begin()
        until(found.is_ready)
    return found


@pytest.fixture
def jobs(server, tmp_path, monkeypatch):
    """A queue whose processes are forks: none is started in another way."""

    def refuse(*_, **options):
        raise OSError("it is not a fork")

    monkeypatch.setattr(child, "start", refuse)
    found = Jobs(Folder(tmp_path))
    yield found
    found.stop()


def test_a_job_is_computed_by_a_fork_that_loads_nothing(jobs, server):
    job = jobs.add("run", "brief", case=BRIEF)
    until(lambda: not job.open)
    assert job.status == "success", job.message
    found = results.open(jobs.result(job.key))
    assert found["ball"].position.values[-1, 2] == pytest.approx(-5.0, abs=1e-6)
    assert server.is_ready()


def test_a_fork_is_cancelled_killed_and_reported_as_a_process_is(jobs):
    killed = jobs.add("run", "killed", case=LONG)
    until(lambda: killed.marks)
    jobs._process.kill()
    until(lambda: not killed.open)
    assert killed.status == "failed"
    assert killed.message == "its process died"
    long = jobs.add("run", "long", case=LONG)
    until(lambda: len(long.marks) > 1)
    jobs.cancel(long.key)
    until(lambda: not long.open)
    assert long.status == "interrupted"
    assert results.open(jobs.result(long.key)).attrs["status"] == "interrupted"
    wrong = jobs.add("run", "wrong", case=BRIEF.replace("1 kg", "-1 kg"))
    until(lambda: not wrong.open)
    assert wrong.status == "failed"
    assert wrong.message.startswith("parts.ball.mass is '-1 kg'")


def test_a_fork_has_the_environment_folder_and_session_that_it_is_given(server, tmp_path, monkeypatch):
    """What limits the files that it opens is set after the server has started."""
    monkeypatch.setenv("EVOLVENT_ONLY_BELOW", str(tmp_path / "below"))
    (tmp_path / "empty").mkdir()
    with open(tmp_path / "log", "w") as log:
        found = server.fork("worker", tmp_path, folder=tmp_path / "empty", stderr=log)
    about = f"/proc/{found.pid}"
    until(lambda: os.getsid(found.pid) == found.pid)
    until(lambda: os.readlink(f"{about}/cwd") == str(tmp_path / "empty"))
    (tmp_path / "above.npz").write_bytes(b"")
    case = {"system": "structure", "parts": {"b": {"kind": "reduced-body", "file": str(tmp_path / "above.npz")}}}
    asked = {"kind": "run", "case": json.dumps(case), "signals": []}
    found.stdin.write(json.dumps(asked) + "\n")
    found.stdin.flush()
    (message,) = (json.loads(line) for line in found.stdout)
    assert "it is outside the folder" in message["message"]
    assert found.wait(60.0) == 0
    assert found.poll() == 0
    child.close(found)
    found.kill()  # it has ended, and no other process is


def test_the_way_in_which_a_fork_ends_is_known(server, tmp_path):
    ends = []
    for how in (lambda one: one.stdin.close(), lambda one: os.kill(one.pid, signal.SIGTERM)):
        with open(tmp_path / "log", "w") as log:
            found = server.fork("worker", tmp_path, folder=tmp_path, stderr=log)
        with pytest.raises(subprocess.TimeoutExpired):
            found.wait(0.01)
        how(found)
        ends.append(found.wait(60.0))
        child.close(found)
    assert ends == [1, -signal.SIGTERM]


def test_without_a_server_a_process_loads_for_itself(tmp_path, monkeypatch):
    started = []
    monkeypatch.setattr(warm, "server", warm.Server)
    monkeypatch.setattr(child, "start", lambda *given, **named: started.append(given))
    assert warm.start("worker", tmp_path, folder=tmp_path, stderr=None) is None
    assert started == [("worker", tmp_path)]


def test_a_server_that_dies_is_replaced_by_processes_that_load(server, tmp_path):
    server._process.kill()
    server._process.wait()
    assert not server.is_ready()
    assert server.fork("worker", tmp_path, folder=tmp_path, stderr=None) is None
    server.end()
