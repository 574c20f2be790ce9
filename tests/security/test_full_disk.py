"""A full disk ends every command with one sentence; what was there stays, and nothing half-written is left."""

from __future__ import annotations

import contextlib
import json
import os
import pathlib
import signal
import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

from evolvent import InputError, cases, results
from evolvent.design import studies
from evolvent_base import files, plots

resource = pytest.importorskip("resource", reason="limits of files are those of POSIX")

CODE = """
import resource, sys
sys.dont_write_bytecode = True
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
sys.argv = ["evolvent", "run", "heliogyro", "-o", "run.nc", "--no-figures", "--quiet", "--set", "solver.method=dopri5"]
sys.argv += ["--set", "blade.segments=inextensible"]
from evolvent_base import cli
cli.main()
"""


@contextlib.contextmanager
def full(size: int) -> Iterator[None]:
    """No file may grow beyond `size` bytes; Python keeps none of its own, which it would cut off without an error."""
    before, kept = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        sys.dont_write_bytecode = kept


def listed(folder: pathlib.Path) -> list[str]:
    """Names of all files in a folder and below."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


@pytest.mark.slow
def test_a_run_that_cannot_be_kept_ends_without_a_fault(tmp_path: pathlib.Path) -> None:
    """In its own process: HDF5 files that could not be written ended it with a fault after its message."""
    done = subprocess.run([sys.executable, "-c", CODE], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "evolvent: cannot write 'run.nc': file too large\n"
    assert not listed(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("plot", "{run}", "--figures", "figures"),
        ("report", "{run}", "-o", "report.html"),
        *(
            ("export", "{run}", "--frames", "2", "--to", kind, "-o", f"run.{kind}")
            for kind in ("mat", "html", "gif", "mp4")
        ),
        ("export", "{run}", "--to", "vtk", "-o", "vtk"),
        ("export", "{run}", "--to", "csv", "-o", "csv"),
        ("modes", "hanging-chain", "-o", "modes.nc"),
    ],
    ids=lambda words: f"{words[0]} {words[-1]}",
)
def test_a_full_disk_is_one_sentence(words, call, structure_run, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(plots, "picture", lambda figure, kind, **_: bytes(1000))  # to draw one takes far longer
    with full(300):
        code, _, err = call(*(word.format(run=structure_run) for word in words))
    assert code == 2
    assert err.count("\n") == 1
    assert err.startswith("evolvent: cannot write ")
    assert words[-1] in err
    assert not listed(tmp_path)


@pytest.mark.slow
def test_what_was_there_stays(whole_run: pathlib.Path, run_copy: pathlib.Path) -> None:
    before = run_copy.read_bytes()
    with full(5000), pytest.raises(InputError, match=r"cannot write .*: file too large"):
        results.save(results.open(whole_run), run_copy)
    assert run_copy.read_bytes() == before
    assert listed(run_copy.parent) == ["run.nc"]


@pytest.mark.slow
@pytest.mark.parametrize("size", [0, 300, pytest.param(900, marks=pytest.mark.release), 4000, 12_000])
def test_a_study_goes_on_once_there_is_room(size: int, whole_study: pathlib.Path, tmp_path: pathlib.Path) -> None:
    study = tmp_path / "study.yaml"
    study.write_text((whole_study / "study.yaml").read_text())
    with full(size), pytest.raises(InputError, match=r"cannot write .*: (file too large|disk I/O error)"):
        studies.sweep(study, output=tmp_path / "pay-out", workers=1)
    assert not [name for name in listed(tmp_path) if "part" in name or "zarr" in name]
    found = studies.sweep(study, output=tmp_path / "pay-out", workers=1)
    assert found.identical(studies.open(whole_study))


def test_what_killed_processes_left_goes(run_copy: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Not what living ones, or those of other computers, write."""
    code = "import os, time; print(os.getpid(), flush=True); time.sleep(60)"
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    number = int(process.stdout.readline())
    folder, host = run_copy.parent, files._host()
    mine = folder / f".run.nc.{host}-{number}-0123456789ab.part"
    others = folder / f".run.nc.{'0' * 8}-{number}-0123456789ab.part"
    foreign = folder / ".download.part"
    for path in (mine, others, foreign):
        path.write_bytes(b"half")
    monkeypatch.setattr(files, "_LOOKED", {})
    files.write_file(folder / "first.txt", "text")
    assert mine.exists()
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    files.write_file(folder / "second.txt", "text")
    assert mine.exists()  # a folder is searched once a minute
    monkeypatch.setattr(files, "_LOOKED", {})
    files.write_file(folder / "third.txt", "text")
    assert listed(folder) == sorted([others.name, foreign.name, "first.txt", "second.txt", "third.txt", "run.nc"])


def test_the_temporary_name_is_that_of_this_process(tmp_path: pathlib.Path) -> None:
    with files.writing(tmp_path / "run.nc") as temporary:
        found = files._PART.fullmatch(os.path.basename(temporary))
        assert found is not None
        assert int(found[2]) == os.getpid()
        pathlib.Path(temporary).write_text("text")
    assert listed(tmp_path) == ["run.nc"]


def test_evaluations_of_a_calibration_that_cannot_be_kept(call, tmp_path: pathlib.Path) -> None:
    times = np.linspace(0.0, 1.0, 5)
    (tmp_path / "data.csv").write_text("time,spin\n" + "".join(f"{t},{6.0 - t}\n" for t in times))
    case = cases.content_of("heliogyro", {"blade.segments": "inextensible", "solver.method": "dopri5"})
    (tmp_path / "short.yaml").write_text(json.dumps(case))
    words = ("short.yaml", "data.csv", "--fit", "blade.tip_mass", "--observe", "body_rate=spin", "--quiet")
    with full(10):
        code, _, err = call("calibrate", *words)
    assert (code, err.count("\n")) == (2, 1)
    assert err.startswith("evolvent: cannot write 'short-calibration")
    assert json.dumps(listed(tmp_path)).count("evaluations") <= 1
