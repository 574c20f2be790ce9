"""A hostile working folder: an unpacked archive or a cloned repository must not harm who opens the studio in it."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import pathlib
import pickle
import shutil
import stat
import subprocess
import sys
import threading
import time
import types

import pytest

from evolvent import cases
from evolvent.design import studies
from evolvent_base import cli
from evolvent_base.errors import EvolventError, InputError
from evolvent_studio import child
from evolvent_studio.command import studio as command
from evolvent_studio.folder import Folder
from evolvent_studio.jobkinds import KINDS
from evolvent_studio.jobs import Jobs
from evolvent_studio.state import Studio
from studio.serving import SHORT

pytestmark = pytest.mark.skipif(os.name == "nt", reason="links, FIFOs and modes of files as POSIX has them")

OWN = ".evolvent-studio"
PRECIOUS = "precious\n"
WAITING = {"key": "0001-a", "kind": "run", "title": "a", "status": "waiting"}


@pytest.fixture(autouse=True)
def own_state(tmp_path, monkeypatch):
    """A state folder of the user that the test may write to."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.fixture
def root(tmp_path):
    """A working folder with a folder of state."""
    place = tmp_path / "work"
    (place / OWN / "0001-a").mkdir(parents=True)
    (place / OWN / "0001-a" / "case.yaml").write_text(SHORT)
    return place


@pytest.fixture
def outside(tmp_path):
    """Files outside the working folder."""
    place = tmp_path / "outside"
    place.mkdir()
    (place / "precious.txt").write_text(PRECIOUS)
    return place


@pytest.fixture
def started(monkeypatch):
    """Processes that the queue starts: they are noted, and none is."""
    found = []

    def start(command, **options):
        if "worker" not in command:  # of what reads files
            return subprocess.Popen(command, **options)
        found.append({"command": command, **options, "in it": os.listdir(options["cwd"])})
        raise OSError("this test starts no process")

    monkeypatch.setattr(child, "subprocess", types.SimpleNamespace(**vars(subprocess) | {"Popen": start}))
    return found


def written(place):
    """Files below a folder with their contents."""
    return {path.name: path.read_bytes() for path in place.rglob("*") if path.is_file()}


def finished(action, seconds=20.0):
    """What an action returns, or the sentence that it refuses with; fails where it hangs."""
    found = []

    def run():
        try:
            found.append(action())
        except EvolventError as error:
            found.append(str(error))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    thread.join(seconds)
    assert not thread.is_alive(), "it hangs"
    assert found, "it raised something else than a sentence"
    return found[0]


def settled(jobs, seconds=10.0):
    """Wait until no job is waiting or running."""
    end = time.monotonic() + seconds
    while any(job.status in ("waiting", "running") for job in jobs.listed()) and time.monotonic() < end:
        time.sleep(0.02)


def opened(root):
    """What the studio does with a folder when it is opened, and a run and an upload of the user."""
    try:
        found = Jobs(Folder(root))
    except InputError:
        return
    try:
        settled(found)
        try:
            found.add("run", "mine", case=SHORT)
            Folder(root).keep("knock.csv", b"1,2\n")
        except (InputError, OSError):
            pass
        settled(found)
    finally:
        found.stop()


# ------------------------------------------------------------------------------------------------ links

LINKS = ("lock", "queue.json", "queue.part", "0001-a/log.txt", "0001-a/case.yaml", "0002-mine/case.yaml",
         "0002-mine/log.txt", "0002-mine/job.json", "uploads/knock.csv")  # fmt: skip


@pytest.mark.parametrize("link", LINKS)
@pytest.mark.parametrize("target", ["precious.txt", "new.txt"])
def test_a_link_to_a_file_outside_is_not_written_through(root, outside, started, link, target):
    (root / OWN / "queue.json").write_text(json.dumps([WAITING]))
    path = root / OWN / link
    path.parent.mkdir(exist_ok=True)
    path.unlink(missing_ok=True)
    path.symlink_to(outside / target)
    opened(root)
    assert written(outside) == {"precious.txt": PRECIOUS.encode()}


@pytest.mark.parametrize("link", ["", "0001-a", "0002-mine", "uploads"])
def test_a_link_to_a_folder_outside_is_not_written_through(root, outside, started, link):
    (root / OWN / "queue.json").write_text(json.dumps([WAITING]))
    path = root / OWN / link
    if path.is_dir():
        for entry in sorted(path.rglob("*"), reverse=True):
            entry.rmdir() if entry.is_dir() else entry.unlink()
        path.rmdir()
    path.symlink_to(outside, target_is_directory=True)
    opened(root)
    assert written(outside) == {"precious.txt": PRECIOUS.encode()}


def test_a_link_in_the_folder_of_an_own_job_stops_it_before_it_writes(root, outside, started):
    jobs = Jobs(Folder(root))
    key = jobs.add("run", "mine", case=SHORT).key
    settled(jobs)
    jobs.get(key).status = "waiting"
    (jobs.folder_of(key) / "run.nc").symlink_to(outside / "precious.txt")
    with jobs._lock:
        jobs._wake.notify_all()
    settled(jobs)
    job = jobs.get(key)
    jobs.stop()
    assert (job.status, len(started)) == ("failed", 1)
    assert "run.nc' is neither a regular file nor a folder" in job.message
    assert (outside / "precious.txt").read_text() == PRECIOUS


def test_a_result_that_is_a_link_is_not_opened(root, outside, started):
    names = {(kind, name) for kind, one in KINDS.items() for name in (one.result, *one.report[:1], *one.kept.values())}
    for kind, name in sorted(names):
        (root / OWN / "queue.json").write_text(json.dumps([WAITING | {"kind": kind, "status": "success"}]))
        (outside / "results.zarr").mkdir(exist_ok=True)
        (outside / "report.html").touch()
        target = outside if name in ("study", "calibration") else outside / "precious.txt"
        link = root / OWN / "0001-a" / name
        link.symlink_to(target)
        studio = Studio(Folder(root))
        try:
            assert studio.jobs.result("0001-a") is None
            with pytest.raises(InputError):
                studio.path("job:0001-a")
            with pytest.raises(InputError):
                studio.report("job:0001-a")
            with pytest.raises(InputError):
                studio.beside("job:0001-a", name)
        finally:
            studio.jobs.stop()
        link.unlink()


def test_a_folder_that_is_given_by_a_link_is_used(root, tmp_path, started):
    (tmp_path / "link").symlink_to(root, target_is_directory=True)
    jobs = Jobs(Folder(tmp_path / "link"))
    jobs.add("run", "mine", case=SHORT)
    jobs.stop()
    assert (root / OWN / "queue.json").is_file()


@pytest.mark.slow
def test_no_upload_leaves_the_folder_while_another_program_swaps_folders_for_links(root, outside):
    """Every component is opened by itself and as no link, so that no moment between check and use is left."""
    uploads = root / OWN / "uploads"
    ended = threading.Event()

    def swap():
        while not ended.is_set():
            with contextlib.suppress(OSError):
                uploads.symlink_to(outside, target_is_directory=True)
                uploads.unlink()
            shutil.rmtree(uploads, ignore_errors=True)

    thread = threading.Thread(target=swap)
    thread.start()
    folder, kept = Folder(root), 0
    try:
        end = time.monotonic() + 3.0
        while time.monotonic() < end or (kept == 0 and time.monotonic() < end + 30.0):
            try:
                folder.keep("knock.csv", os.urandom(4))
                kept += 1
            except (InputError, OSError):
                pass
    finally:
        ended.set()
        thread.join()
    assert kept
    assert written(outside) == {"precious.txt": PRECIOUS.encode()}


# ------------------------------------------------------------------------------------------------ the queue


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("status", ["waiting", "running", "cancelling"])
def test_a_queue_from_elsewhere_starts_nothing(root, outside, started, kind, status):
    (root / OWN / "0001-a" / "job.json").write_text(json.dumps({"kind": kind, "signals": [str(outside / "run.nc")]}))
    content = WAITING | {"kind": kind, "status": status, "extra": {"signals": [str(outside / "run.nc")]}}
    (root / OWN / "queue.json").write_text(json.dumps([content]))
    jobs = Jobs(Folder(root))
    settled(jobs)
    job = jobs.get("0001-a")
    jobs.stop()
    assert started == []
    assert (job.status, job.message) == ("not started", "queued by another installation")
    assert "signals" not in job.extra


def queued(root, started):
    """The queue of a folder with a job of this installation that waits."""
    jobs = Jobs(Folder(root))
    with jobs._lock:
        jobs._stopped = True  # it does not begin
        jobs.add("run", "mine", case=SHORT)
    jobs.stop()
    (content,) = json.loads((root / OWN / "queue.json").read_text())
    return content


def loaded(root):
    """The first job of a folder's queue, after the queue was opened."""
    jobs = Jobs(Folder(root))
    settled(jobs)
    job = jobs.listed()[-1]
    jobs.stop()
    return job


def test_a_job_of_this_installation_goes_on_and_a_changed_one_does_not(root, started, tmp_path):
    content = queued(root, started)
    assert content["status"] == "waiting"
    digest = hashlib.sha256(SHORT.encode()).hexdigest()
    assert content["digest"] == digest
    loaded(root)
    assert len(started) == 1
    changes = (
        {"signature": ""}, {"signature": None}, {"signature": "é"}, {"signature": "0" * 64}, {"title": "other"},
        {"kind": "identify", "extra": {"signals": ["/etc/passwd"]}}, {"extra": {"x": 1}}, {"digest": "0" * 64},
    )  # fmt: skip
    for change in changes:
        (root / OWN / "queue.json").write_text(json.dumps([content | change]))
        job = loaded(root)
        assert job.status == "not started", change
    assert len(started) == 1
    # the case beside it was exchanged: the job is this installation's, its case is not
    (root / OWN / "queue.json").write_text(json.dumps([content]))
    (root / OWN / content["key"] / "case.yaml").write_text(SHORT.replace("6 rad/s", "7 rad/s"))
    job = loaded(root)
    assert (job.status, job.message) == ("failed", "its case was changed after it was queued; run the case again")
    assert len(started) == 1
    # the same queue in another folder
    other = tmp_path / "other"
    (other / OWN / content["key"]).mkdir(parents=True)
    (other / OWN / content["key"] / "case.yaml").write_text(SHORT)
    (other / OWN / "queue.json").write_text(json.dumps([content]))
    assert loaded(other).status == "not started"
    assert len(started) == 1


def test_a_job_from_elsewhere_is_never_signed(root, started):
    (root / OWN / "queue.json").write_text(json.dumps([WAITING]))
    for _ in range(2):
        jobs = Jobs(Folder(root))
        jobs.add("run", "mine", case=SHORT)
        settled(jobs)
        jobs.stop()
    assert jobs.get("0001-a").status == "not started"
    signed = {c["key"]: bool(c["signature"]) for c in json.loads((root / OWN / "queue.json").read_text())}
    assert signed == {"0001-a": False, "0002-mine": True, "0003-mine": True}


def test_a_study_from_elsewhere_does_not_go_on_at_a_click(root, started):
    (root / OWN / "queue.json").write_text(json.dumps([WAITING | {"kind": "sweep", "status": "interrupted"}]))
    jobs = Jobs(Folder(root))
    with pytest.raises(InputError, match="queued by another installation"):
        jobs.resume("0001-a")
    jobs.stop()
    assert started == []


def test_the_secret_is_the_users_alone(root, started, tmp_path):
    queued(root, started)
    path = tmp_path / "state" / "evolvent" / "studio.key"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    secret = path.read_bytes()
    assert len(secret) == 32
    assert secret.hex() not in "".join(p.read_text() for p in root.rglob("*.json"))
    # who can read it can sign: another is made, and what the old one has signed does not start
    path.chmod(0o644)
    assert loaded(root).status == "not started"
    assert path.read_bytes() != secret
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    path.unlink()
    path.symlink_to(tmp_path / "planted.key")
    (tmp_path / "planted.key").write_bytes(bytes(32))
    (root / OWN / "queue.json").unlink()
    queued(root, started)
    assert not path.is_symlink()
    assert path.read_bytes() != bytes(32)


def test_strange_entries_of_a_queue_are_left_out(root, started):
    for name in ("0002-b", "0003-c"):
        (root / OWN / name).mkdir()
    listed = [
        7, None, "x", [], {}, WAITING | {"key": 5}, WAITING | {"key": "../../x"}, WAITING | {"key": "0001-a/.."},
        WAITING | {"kind": "__class__"}, WAITING | {"title": ["<b>"]}, WAITING | {"title": None},
        WAITING | {"reached": "x"}, WAITING | {"elapsed": float("nan")}, WAITING | {"extra": [1]},
        WAITING | {"extra": {"rows": 7}}, WAITING | {"extra": {"rows": [[{"a": 1}]]}},
        WAITING | {"key": "0002-b", "own": True, "marks": [1]}, WAITING | {"key": "9999-absent"},
        WAITING | {"key": "0003-c", "status": "onload"},
    ]  # fmt: skip
    (root / OWN / "queue.json").write_text(json.dumps(listed))
    jobs = Jobs(Folder(root))
    settled(jobs)
    listed = [(job.key, job.status, job.own) for job in jobs.listed()]
    jobs.stop()
    assert listed == [("0003-c", "not started", False), ("0002-b", "not started", False)]
    assert started == []


@pytest.mark.parametrize(
    "content", ["[" * 200_000, "{}", "nonsense", '[{"key": ' + "9" * 10_000 + "}]", "[" + "7," * 9]
)
def test_a_damaged_queue_is_left_out_with_a_sentence(root, started, content):
    (root / OWN / "queue.json").write_text(content)
    jobs = finished(lambda: Jobs(Folder(root)))
    listed, note = jobs.listed(), jobs.note
    jobs.stop()
    assert listed == []
    assert note.startswith("the queue of the folder is left out: '.evolvent-studio/queue.json'")


@pytest.mark.parametrize("key", ["9999-z", "9998-z"])
def test_large_numbers_of_runs_leave_room_for_new_ones(root, started, key):
    (root / OWN / key).mkdir()
    (root / OWN / "queue.json").write_text(json.dumps([WAITING | {"key": key, "status": "success"}]))
    jobs = Jobs(Folder(root))
    keys = {jobs.add("run", "mine", case=SHORT).key for _ in range(3)}
    settled(jobs)
    jobs.stop()
    assert len(keys) == 3
    assert all(len(k.partition("-")[0]) == 4 for k in keys)


# ------------------------------------------------------------------------------------------------ special files


@pytest.mark.parametrize("name", ["queue.json", "lock", "0001-a/case.yaml", "uploads/knock.csv"])
def test_a_fifo_in_the_state_does_not_hang(root, started, name):
    (root / OWN / "queue.json").write_text(json.dumps([WAITING]))
    path = root / OWN / name
    path.parent.mkdir(exist_ok=True)
    path.unlink(missing_ok=True)
    os.mkfifo(path)
    finished(lambda: opened(root))


def test_a_fifo_among_the_users_files_does_not_hang(root, started):
    for name in ("case.yaml", "run.nc", "signal.csv"):
        os.mkfifo(root / name)
    studio = finished(lambda: Studio(Folder(root)))
    try:
        assert "not a regular file" in finished(lambda: studio.open_case("file:case.yaml"))
        assert "not a regular file" in finished(lambda: studio.load("file:run.nc"))
        finished(studio.sources), finished(studio.study_sources), finished(studio.stands)
        job = studio.jobs.add("identify", "x", case="stand: {kind: torsion}", extra={"signals": ["signal.csv"]})
        settled(studio.jobs)
        assert (job.status, started) == ("failed", [])
        assert "not a regular file" in job.message
    finally:
        studio.jobs.stop()


@pytest.mark.parametrize("name", ["queue.json", "0001-a/case.yaml"])
def test_a_huge_state_file_is_not_read(root, started, name):
    (root / OWN / "queue.json").write_text(json.dumps([WAITING]))
    os.truncate(root / OWN / name, 1 << 42)  # 4 TiB, all of it a hole
    jobs = finished(lambda: Jobs(Folder(root)))
    try:
        if name == "queue.json":
            assert "too large" in jobs.note
        else:
            assert "too large" in finished(lambda: jobs.case("0001-a"))
    finally:
        jobs.stop()


# ------------------------------------------------------------------------------------------------ what cases name


@pytest.mark.parametrize(
    "name",
    ["../outside/run.nc", "/etc/passwd", "/etc/../etc/passwd", "sub/../../outside/run.nc", "linked/run.nc", "link.nc",
     "\\\\host\\share\\run.nc", "//host/share/run.nc", " /etc/x.nc", "x.nc\0.nc"],
)  # fmt: skip
def test_a_case_opens_no_file_outside(root, outside, started, name):
    (outside / "run.nc").write_text("x")
    (root / "linked").symlink_to(outside, target_is_directory=True)
    (root / "link.nc").symlink_to(outside / "run.nc")
    content = cases.content_of("wrapped-rib-deploy") | {"start": name}
    studio = Studio(Folder(root))
    try:
        for action in (studio.take_case, studio.start):
            with pytest.raises(InputError, match="working folder"):
                action(content, print)
        studio.draft.content = content
        with pytest.raises(InputError, match="working folder"):
            studio.submit()
        (root / "nested.yaml").write_text(json.dumps({"system": "wrapped-rib", "rib": [{"file": {"law": [name]}}]}))
        with pytest.raises(InputError):
            studio.open_case("file:nested.yaml")
    finally:
        studio.jobs.stop()
    assert started == []


@pytest.mark.parametrize("name", ["../outside/other.yaml", "./../outside/secret.txt", "/etc/passwd", "link.yaml"])
def test_a_study_opens_no_case_outside(root, outside, name):
    (outside / "other.yaml").write_text(SHORT)
    (outside / "secret.txt").write_text(SHORT)
    (root / "link.yaml").symlink_to(outside / "other.yaml")
    (root / "study.yaml").write_text(json.dumps({"case": name, "over": {"spool.rate": [1.0, 2.0]}}))
    with pytest.raises(InputError, match="outside the working folder"):
        Folder(root).study("study.yaml")


def test_a_study_below_the_folder_reads_its_case_and_start(root):
    (root / "sub").mkdir()
    (root / "sub" / "short.yaml").write_text(SHORT)
    content = {"case": "short.yaml", "over": {"spool.rate": [1.0, 2.0]}, "set": {"start": "runs/a.nc"}}
    (root / "sub" / "study.yaml").write_text(json.dumps(content))
    found = Folder(root).study("sub/study.yaml")
    assert found["case"]["system"] == "heliogyro"
    assert found["set"]["start"] == str(root / "runs" / "a.nc")


def test_own_factors_of_margins_are_read_in_the_folder_alone(root, outside):
    (root / "own.yaml").write_text("revision: mine")
    (outside / "other.yaml").write_text("revision: other")
    (root / "link.yaml").symlink_to(outside / "other.yaml")
    found = Folder(root).placed({"margin": {"factors": "own.yaml"}})
    assert found == {"margin": {"factors": str(root / "own.yaml")}}
    for name in ("../outside/other.yaml", "link.yaml", str(outside / "other.yaml")):
        with pytest.raises(InputError, match="outside the working folder"):
            Folder(root).placed({"margin": {"factors": name}})


def test_texts_are_left_as_they_are(root):
    content = {"title": "from /etc/run.nc", "body": {"rate": "6 rad/s", "axis": "-z", "ratio": "1/2"}}
    assert Folder(root).placed(content) == content


def test_a_finished_study_runs_no_code_and_follows_no_link(root, outside, tmp_path):
    """Its arrays name codecs, and one of them unpickles what it is given."""
    proof = tmp_path / "proof"

    class Attack:
        def __reduce__(self):
            return os.mkdir, (str(proof),)

    place = root / "done"
    array = place / "results.zarr" / "a"
    array.mkdir(parents=True)
    manifest = {"study": "s", "cases": 1, "versions": {}, "hashes": {}}
    (place / "study.json").write_text(json.dumps(manifest))
    (place / "results.zarr" / ".zgroup").write_text('{"zarr_format": 2}')
    head = {"zarr_format": 2, "shape": [1], "chunks": [1], "fill_value": 0.0, "order": "C"}
    (array / ".zattrs").write_text('{"_ARRAY_DIMENSIONS": ["case"]}')
    (array / "0").write_bytes(pickle.dumps(Attack()))
    for kind, codecs in (
        ("|O", {"compressor": None, "filters": [{"id": "pickle"}]}),
        ("<f8", {"compressor": None, "filters": [{"id": "pickle"}]}),
        ("<f8", {"compressor": {"id": "pickle"}, "filters": None}),
    ):
        (array / ".zarray").write_text(json.dumps(head | {"dtype": kind} | codecs))
        with pytest.raises(InputError):
            studies.open(place)
    assert not proof.exists()
    (array / "0").unlink()
    (array / "0").symlink_to(outside / "precious.txt")
    studio = Studio(Folder(root))
    try:
        with pytest.raises(InputError, match="neither a regular file nor a folder"):
            studio.path("file:done")
    finally:
        studio.jobs.stop()


# ------------------------------------------------------------------------------------------------ modules and settings


def test_python_and_libraries_find_nothing_in_the_folder(root, started, monkeypatch):
    """`python -m` looks for modules in its folder, Matplotlib and Numba for their settings."""
    for name in ("numpy.py", "sitecustomize.py", "matplotlibrc", ".numba_config.yaml"):
        (root / name).write_text("raise SystemExit")
    jobs = Jobs(Folder(root))
    jobs.add("run", "mine", case=SHORT)
    settled(jobs)
    jobs.stop()
    (process,) = started
    place = pathlib.Path(process["cwd"])
    assert not place.is_relative_to(root)
    assert process["in it"] == []
    seen = {}
    server = types.SimpleNamespace()
    monkeypatch.setitem(sys.modules, "evolvent_studio.server", server)
    monkeypatch.setattr("evolvent_studio.server", server, raising=False)

    def serve(folder, **options):
        seen.update(folder=folder, cwd=os.getcwd(), listed=os.listdir())

    server.serve = serve
    monkeypatch.chdir(root)
    command.main(["--no-browser", "--port", "0"], standalone_mode=False)
    assert seen["folder"] == str(root)
    assert not pathlib.Path(seen["cwd"]).is_relative_to(root)
    assert seen["listed"] == []
    assert os.getcwd() == str(root)


@pytest.mark.slow
def test_a_worker_in_a_hostile_folder_computes(root):
    """As above, with the process itself: a module of the folder would end it; a fit that fails is reported."""
    for name in ("numpy.py", "numba.py", "yaml.py", "json.py", "evolvent.py"):
        (root / name).write_text("raise SystemExit('code of the folder ran')")
    (root / "log.csv").write_text("time (s),rate (rad/s)\n0,1\n1,2\n2,3\n")
    content = {"case": cases.content_of("boom-slew"), "fit": ["parts.hub.masss"], "observe": ["hub.rate.z=rate"]}
    jobs = Jobs(Folder(root))
    try:
        extra = {"signals": [str(root / "log.csv")]}
        job = jobs.add("calibrate", "mine", case=json.dumps(content), extra=extra)
        settled(jobs, 300.0)
        assert job.status == "failed"
        assert "unknown key 'parts.hub.masss'; did you mean 'parts.hub.mass'?" in job.message
        assert jobs.result(job.key) is None
        assert jobs.report(job.key) is None
    finally:
        jobs.stop()


# ------------------------------------------------------------------------------------------------ uploads


def test_an_upload_replaces_no_file(root):
    folder = Folder(root)
    first = folder.keep("knock.csv", b"1")
    assert folder.keep("knock.csv", b"1") == first
    assert folder.keep("knock.csv", b"2") == f"{OWN}/uploads/knock-2.csv"
    assert folder.keep("../knock.csv", b"3") == f"{OWN}/uploads/knock-3.csv"
    assert folder.keep("knock.csv", b"2") == f"{OWN}/uploads/knock-2.csv"
    assert (root / first).read_bytes() == b"1"


def test_an_upload_that_is_too_large_is_refused_and_leaves_nothing(root):
    with pytest.raises(InputError, match="at most 200 MB"):
        Folder(root).keep("large.csv", bytes(200_000_001))
    assert not list(root.rglob("large*"))


@pytest.mark.parametrize("name", ["..", ".", "", "/", "a\0b.csv", "x" * 5000 + ".csv", "..\\..\\x.csv", "\u202eexe.csv",
                                  "<img src=x onerror=alert(1)>.csv", "con.csv\n", "-rf.csv"])  # fmt: skip
def test_names_of_uploads_stay_plain(root, outside, name):
    kept = Folder(root).keep(name, b"1")
    path = root / kept
    assert path.parent == root / OWN / "uploads"
    assert path.read_bytes() == b"1"
    assert not set(path.name) & set("<>/\\\0\n\"'&")
    assert written(outside) == {"precious.txt": PRECIOUS.encode()}


@pytest.mark.slow
def test_the_command_refuses_a_state_folder_that_is_a_link(root, outside, monkeypatch, capfd):
    for entry in sorted((root / OWN).rglob("*"), reverse=True):
        entry.rmdir() if entry.is_dir() else entry.unlink()
    (root / OWN).rmdir()
    (root / OWN).symlink_to(outside, target_is_directory=True)
    monkeypatch.chdir(root)
    monkeypatch.setattr(sys, "argv", ["evolvent", "studio", "--no-browser", "--port", "0"])
    with pytest.raises(SystemExit) as ended:
        cli.main()
    printed = capfd.readouterr()
    assert (ended.value.code, printed.out) == (2, "")
    assert "'.evolvent-studio' is a link; it must be a folder" in printed.err
    assert len(printed.err.strip().splitlines()) == 1
    assert written(outside) == {"precious.txt": PRECIOUS.encode()}
