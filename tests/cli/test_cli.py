"""The command line: what it prints, what it leaves behind, and how it refuses."""

import json
import os
import pathlib
import re
import signal
import subprocess
import sys

import pytest
from PIL import Image

import evolvent
from evolvent import cases
from evolvent.parts.registry import kinds
from evolvent_base import files

QUICK = [
    "--set",
    "blade.segments=inextensible",
    "--set",
    "solver.method=dopri5",
    "--set",
    "solver.duration=2 s",
]
FIGURES = {
    "body_rate.png",
    "tip_lag.png",
    "shape.png",
    "tension.png",
    "energy-balance.png",
    "momentum.png",
    "animation.html",
}


def test_list_show_schema(call):
    code, out, err = call("list")
    assert (code, err) == (0, "")
    assert any(line.startswith("heliogyro  ") for line in out.splitlines())
    code, out, _ = call("show", "heliogyro")
    assert code == 0
    assert out == cases.text("heliogyro")
    code, out, _ = call("schema", "heliogyro")
    assert code == 0
    assert json.loads(out)["properties"]["body"]
    code, out, _ = call("--version")
    assert (code, out) == (0, f"evolvent {evolvent.__version__}\n")
    for words in (["-h"], ["run", "--help"]):
        code, out, err = call(*words)
        assert (code, err) == (0, "")
        assert "Usage" in out


def test_show_a_file(call, tmp_path):
    (tmp_path / "fall.yaml").write_text("parts: {ball: {kind: point, mass: 200 g}}\nsimulate: {until: 1 s}\n")
    code, out, _ = call("show", "fall.yaml")
    assert code == 0
    shown = cases.load(cases.parse_yaml(out, "out"))
    assert shown == cases.load(tmp_path / "fall.yaml")
    assert "method: auto" in out  # a default
    code, _, err = call("show", "fal")
    assert code == 2
    assert err.startswith("evolvent: no case is called 'fal'")


def test_show_with_parts_written_out(call, tmp_path):
    ball = "ball: {kind: point, mass: 200 g, repeat: {count: 2, step: [1 m, 0, 0]}}"
    (tmp_path / "row.yaml").write_text(f"parts: {{{ball}, ball 2: {{mass: 300 g}}}}\nsimulate: {{until: 1 s}}\n")
    code, out, err = call("show", "row.yaml", "--expand")
    assert (code, err) == (0, "")
    content = cases.parse_yaml(out, "out")
    assert [part["mass"] for part in content["parts"].values()] == ["200 g", "300 g"]
    assert cases.load(content) == cases.load(tmp_path / "row.yaml")
    ring = "ball: {kind: point, mass: 200 g, position: [1 m, 0, 0], repeat: {count: 4, axis: [0, 0, 1]}}"
    (tmp_path / "ring.yaml").write_text(f"parts: {{{ring}}}\nsimulate: {{until: 1 s}}\n")
    content = cases.parse_yaml(call("show", "ring.yaml", "--expand")[1], "out")
    assert [part["position"] for part in content["parts"].values()][1:] == [[0, 1, 0], [-1, 0, 0], [0, -1, 0]]


def test_parts_and_their_keys(call):
    code, out, err = call("parts")
    assert (code, err) == (0, "")
    assert {line.split("  ")[0] for line in out.splitlines() if line[0] != " "} == set(kinds())
    for kind in kinds():
        code, out, _ = call("parts", kind)
        assert code == 0
        keys = {key for line in re.findall(r"^(?:\w+, )*\w+", out, re.MULTILINE) for key in line.split(", ")}
        assert set(kinds()[kind].model_fields) - {"kind"} <= keys
        assert not re.search(r"`[A-Z]|evolvent\.\w+\.", out)  # kinds and keys, no classes of Python
    out = " ".join(call("parts", "beam")[1].split())
    assert "length [m], required Length of the axis without stress." in out
    assert "rectangle: {thickness, width}; tube: {radius, thickness}" in out
    assert "One of spherical, revolute, universal, clamp, prismatic," in " ".join(call("parts", "joint")[1].split())
    assert "ramp: {rate, angle, steps}" in " ".join(call("parts", "reel")[1].split())
    assert "Rows [time, value], or one of table, ramp, sine" in " ".join(call("parts", "load")[1].split())
    code, _, err = call("parts", "baem")
    assert (code, err) == (2, "evolvent: no part is of the kind 'baem'; did you mean 'beam'?\n")


@pytest.mark.slow
@pytest.mark.usefixtures("sketched")
def test_run_leaves_table_results_and_figures(call, tmp_path):
    code, out, err = call("run", "heliogyro", *QUICK, "-o", "run.nc", "--figures", "figures")
    assert code == 0
    assert "compiling" in err or err == ""
    for words in (
        "success",
        "body rate at the end",
        "largest gap to eq. (18)",
        "mean tip lag",
        "energy balance",
        "steps",
    ):
        assert words in out
    run = evolvent.open("run.nc")
    assert f"{float(run.body_rate[-1]):.6g} rad/s" in out
    assert {p.name for p in (tmp_path / "figures").iterdir()} == FIGURES
    assert {p.name for p in tmp_path.iterdir()} == {"run.nc", "figures"}

    code, out, err = call("info", "run.nc")
    assert (code, err) == (0, "")
    assert f"{float(run.body_rate[-1]):.6g} rad/s" in out
    for words in ("tip_lag", "kg m2 s-1", "segments: inextensible", "(time, blade)"):
        assert words in out

    for words, folder in ((["--figures", "again"], "again"), ([], "run-figures")):
        code, out, err = call("plot", "run.nc", *words)
        assert (code, err) == (0, "")
        assert {p.name for p in (tmp_path / folder).iterdir()} == FIGURES


@pytest.mark.slow
@pytest.mark.usefixtures("sketched")
def test_a_run_without_output_keeps_everything_in_a_new_folder(call, tmp_path):
    quick = [*QUICK, "--set", "blade.nodes=3"]
    everything = FIGURES | {"run.nc", "report.html"}
    code, out, err = call("run", "heliogyro", *quick)
    assert (code, err) == (0, "")
    last = out.splitlines()[-1]
    assert last.startswith("results: run.nc, ")
    assert last.endswith("animation.html, report.html in heliogyro-run")
    assert {p.name for p in (tmp_path / "heliogyro-run").iterdir()} == everything
    written = (tmp_path / "heliogyro-run" / "run.nc").read_bytes()
    assert call("run", "heliogyro", *quick, "--quiet", "--no-figures")[1] == ""
    assert {p.name for p in (tmp_path / "heliogyro-run-2").iterdir()} == {"run.nc"}
    code, out, _ = call("run", "heliogyro", *quick, "--figures", "f")
    assert out.splitlines()[-2] == "results: run.nc, report.html in heliogyro-run-3"
    assert {p.name for p in (tmp_path / "f").iterdir()} == FIGURES
    # a folder that exists is never written into
    assert (tmp_path / "heliogyro-run" / "run.nc").read_bytes() == written
    assert evolvent.open(tmp_path / "heliogyro-run" / "run.nc").attrs["status"] == "success"


@pytest.mark.slow
@pytest.mark.usefixtures("sketched")
def test_figures_are_left_beside_the_results(call, tmp_path):
    quick = [*QUICK, "--set", "blade.nodes=3", "--quiet"]
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "mine.yaml").write_text(cases.text("heliogyro"))
    assert call("run", "a/mine.yaml", *quick)[0] == 0
    assert FIGURES < {p.name for p in (tmp_path / "mine-run").iterdir()}
    assert call("run", "heliogyro", *quick, "-o", "a/run.nc")[0] == 0
    assert {p.name for p in (tmp_path / "a/run-figures").iterdir()} == FIGURES
    assert call("run", "heliogyro", *quick, "-o", "b.nc", "--no-figures")[0] == 0
    assert not (tmp_path / "b-figures").exists()


@pytest.fixture(scope="module")
def compiled():
    """What the runs need is in the cache before a process begins."""
    evolvent.run("heliogyro", {"blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": 0.1})


@pytest.mark.slow
@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize(
    ("shell", "code", "words"),
    [
        (
            "run heliogyro {quick} -o run.nc --no-figures > /dev/full",
            1,
            "evolvent: cannot write the output: no space left on device\n",
        ),
        ("list > /dev/full", 1, "evolvent: cannot write the output: no space left on device\n"),
        ("--version > /dev/full", 1, "evolvent: cannot write the output: no space left on device\n"),
        ("list >&-", 0, ""),
        pytest.param("run heliogyro {quick} -o run.nc --no-figures >&-", 0, "", marks=pytest.mark.release),
        pytest.param(
            "run heliogyro {quick} -o run.nc --no-figures | head -c 1 > one", 0, "", marks=pytest.mark.release
        ),
        ("schema heliogyro | head -c 1 > one", 0, ""),
    ],
)
def test_an_output_that_takes_no_more_is_no_traceback(tmp_path, shell, code, words):
    line = f"{sys.executable} -W ignore -m evolvent {shell.format(quick=' '.join(map(repr, QUICK)))}"
    options = {"cwd": tmp_path, "capture_output": True, "text": True, "check": False}
    done = subprocess.run(["bash", "-c", f"set -o pipefail; {line}"], **options)
    assert (done.returncode, done.stderr) == (code, words)
    if "run.nc" in shell:
        assert evolvent.open(tmp_path / "run.nc").attrs["status"] == "success"


def test_quiet_is_quiet(call):
    code, out, err = call("run", "heliogyro", *QUICK, "--quiet", "-o", "run.nc", "--no-figures")
    assert (code, out) == (0, "")
    assert "compiling" in err or err == ""


@pytest.mark.slow
@pytest.mark.usefixtures("sketched")
def test_a_free_body_gets_its_own_figure(call, tmp_path):
    free = ["--set", "body.motion=free", "--set", "body.mass=2 kg", "--set", "spool.rate=[3.5, 3.4]"]
    code, out, _ = call("run", "heliogyro", *QUICK, *free, "--figures", "f")
    assert code == 0
    assert "drift of linear momentum" in out
    assert {p.name for p in (tmp_path / "f").iterdir()} == {*FIGURES, "body.png", "nutation.png"}


def test_case_file_and_changed_copy(call, tmp_path):
    (tmp_path / "mine.yaml").write_text(cases.text("heliogyro").replace("nodes: 20", "nodes: 5"))
    assert call("run", "mine.yaml", *QUICK, "-o", "run.nc", "--no-figures")[0] == 0
    assert evolvent.open("run.nc")["blade-1"].sizes["node"] == 5


BAD = {
    "misspelt key": (["run", "heliogyro", "--set", "blade.nods=20"], "did you mean 'blade.nodes'?"),
    "wrong unit": (["run", "heliogyro", "--set", "blade.length=5 kg"], "blade.length is '5 kg'; it must be a length"),
    "negative mass": (["run", "heliogyro", "--set", "blade.tip_mass=-1 g"], "blade.tip_mass is '-1 g'"),
    "zero nodes": (["run", "heliogyro", "--set", "blade.nodes=0"], "blade.nodes is 0; it must be a whole number"),
    "drive outruns": (["run", "heliogyro", "--set", "solver.duration=200 s"], "the drive outruns the thread"),
    "offset 0": (["run", "heliogyro", "--set", "body.spool_offset=0 m"], "body.spool_offset is '0 m'"),
    "NaN in a table": (
        ["run", "heliogyro", "--set", "spool.rate=", "--set", "spool.table=[[0, 1], [10 s, .nan]]"],
        "spool.table.1.1 is nan",
    ),
    "unstable step": (["run", "heliogyro", "--set", "solver.step=1 ms"], "above the stability limit"),
    "missing file": (["run", "none.yaml"], "cannot read 'none.yaml': no such file or directory"),
    "unknown case": (["run", "heliogiro"], "did you mean 'heliogyro'?"),
    "bad file": (["run", "bad.yaml"], "bad.yaml, line 2"),
    "no output folder": (["run", "heliogyro", "-o", "none/run.nc"], "there is no folder 'none'"),
    "output is a folder": (["run", "heliogyro", "-o", "."], "it is a folder"),
    "figures is a file": (["run", "heliogyro", "--figures", "bad.yaml"], "is not a folder"),
    "bad assignment": (["run", "heliogyro", "--set", "blade.nodes"], "--set 'blade.nodes' is not of the form"),
    "bad value": (["run", "heliogyro", "--set", "blade.nodes=[1"], "--set blade.nodes=[1, line 1"),
    "unknown option": (["run", "heliogyro", "--figure", "x"], "no such option: --figure; did you mean '--figures'?"),
    "unknown command": (["rn", "heliogyro"], "no command is called 'rn'; did you mean 'run'?"),
    "no command": (
        [],
        "no command is given; known: calibrate, claims, clearance, design, design-drive, disperse, equilibrium, export",
    ),
    "no case": (["run"], "missing argument 'CASE|FILE'; usage: "),
    "one word too many": (["show", "heliogyro", "more"], "got unexpected extra argument (more); usage: "),
    "output twice": (["run", "heliogyro", "-o", "a", "-o", "b"], "--output is given 2 times, as 'a', 'b'"),
    "figures twice": (["run", "heliogyro", "--figures", "a", "--figures", "b"], "--figures is given 2 times"),
    "key twice": (["run", "heliogyro", *2 * ["--set", "blade.nodes=3"]], "--set gives 'blade.nodes' twice"),
    "certificate twice": (["identify", "a", "--stand", "b", "-o", "c", "-o", "d"], "--output is given 2 times"),
    "stand's key twice": (["identify", "a", "--stand", "b", *2 * ["--set", "body.mass=1"]], "--set gives 'body.mass'"),
    "certificate is the stand": (["identify", "a", "--stand", "bad.yaml", "-o", "bad.yaml"], "is the stand's file"),
    "certificate is the signal": (
        ["identify", "a", "heliogyro.yaml", "--stand", "b", "-o", "./heliogyro.yaml"],
        "-o './heliogyro.yaml' is one of the signals' files; name another, such as 'certificate.html'",
    ),
    "order 0": (
        ["run", "inertia-stand", "--set", "identification.order=0"],
        "evolvent: identification.order is 0; it must be",
    ),
    "output is a device": (["run", "heliogyro", "-o", "/dev/null"], "'/dev/null': it is not a regular file"),
    "output is the case": (["run", "heliogyro.yaml", "-o", "./heliogyro.yaml"], "is the case file itself"),
    "output has no name": (["run", "heliogyro", "-o", ""], "cannot write '': the name is empty"),
    "output has a long name": (["run", "heliogyro", "-o", 300 * "x"], "the name is too long, with 300 characters"),
    "figures have no name": (["run", "heliogyro", "--figures", ""], "cannot write into '': the name is empty"),
    "figures in a file": (["run", "heliogyro", "-o", "a", "--figures", "a/b"], "for -o writes the file 'a'"),
    "figures and none": (["run", "heliogyro", "--no-figures", "--figures", "b"], "give one of them"),
    "too many steps": (["run", "heliogyro", "--set", "solver.step=1 ns"], "1.4e+11 steps over"),
    "too stiff": (["run", "heliogyro", "--set", "blade.stiffness=1e15"], "less damping or stiffness"),
    "plot without a name": (["plot", ""], "cannot read '': the name is empty"),
    "unknown shown": (["show", "heliogiro"], "did you mean 'heliogyro'?"),
    "unknown schema": (["schema", "helio"], "did you mean 'heliogyro'?"),
    "missing results": (["info", "none.nc"], "cannot read 'none.nc': no such file or directory"),
    "damaged results": (["info", "bad.yaml"], "it is not an HDF5 file, or it is damaged"),
    "damaged results drawn": (["plot", "bad.yaml"], "it is not an HDF5 file, or it is damaged"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_line_and_code_2(call, tmp_path, name):
    words, message = BAD[name]
    (tmp_path / "bad.yaml").write_text("body: {inertia: 3\n")
    (tmp_path / "heliogyro.yaml").write_text(cases.text("heliogyro"))
    code, out, err = call(*words)
    assert (code, out) == (2, "")
    assert message in err
    assert err.startswith("evolvent: ")
    lines = [line for line in err.splitlines() if "compiling" not in line]
    assert len(lines) == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bad.yaml", "heliogyro.yaml"]
    assert (tmp_path / "heliogyro.yaml").read_text() == cases.text("heliogyro")


def test_a_run_is_not_written_over_the_run_that_it_starts_from(call, tmp_path):
    (tmp_path / "wind.nc").write_text("kept")
    code, out, err = call("run", "wrapped-rib-deploy", "--set", "start=wind.nc", "-o", "./wind.nc")
    assert (code, out) == (2, "")
    assert err == "evolvent: -o './wind.nc' is the file that start names; name another, such as 'run.nc'\n"
    assert (tmp_path / "wind.nc").read_text() == "kept"


@pytest.mark.parametrize("words", [["-o", "run.nc"], ["--figures", "f"]])
def test_unwritable_folder_is_refused_before_the_run(call, monkeypatch, tmp_path, words):
    def refuse(**where):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(files.tempfile, "TemporaryFile", refuse)
    code, out, err = call("run", "heliogyro", *words)
    assert (code, out) == (2, "")
    assert err.startswith(f"evolvent: cannot write {words[1]!r}: permission denied")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_failed_run_is_labelled_on_its_pictures_and_its_page_needs_nothing_else(call, monkeypatch):
    from evolvent.solvers.common import balance

    monkeypatch.setattr(balance, "GAINED", 1e-30)
    monkeypatch.setattr(balance, "ROUND_OFF", 0.0)
    code, out, err = call("run", "heliogyro", *QUICK, "-o", "run.nc")
    assert code == 1
    assert err.splitlines()[-1].startswith("evolvent: the energy balance is off")
    assert "failed" in out
    run = evolvent.open("run.nc")
    assert run.attrs["status"] == "failed"
    for figure in cases.system("heliogyro").figures(run):  # every figure is marked as of a failed run
        path = pathlib.Path(f"run-figures/{figure.name}.png")
        assert path.read_bytes().startswith(b"\x89PNG")
        assert path.stat().st_size > 10_000
        drawn = Image.open(path).convert("RGB")
        assert any(color == (0xB0, 0x00, 0x20) for _, color in drawn.getcolors(1 << 24)), figure.name
    page = pathlib.Path("run-figures/animation.html").read_text("utf-8")
    assert "FAILED: the energy balance is off" in page
    assert len(page) < 2_000_000
    assert not any(word in page for word in ("http", "src=", "@DATA@"))


@pytest.mark.slow
def test_ctrl_c_keeps_what_was_computed(tmp_path):
    slow = ["--set", "blade.stiffness=1e7 N/m", "--set", "output.every=1 ms", "-o", "run.nc", "--no-figures"]
    program = (
        "from evolvent_base import progress; progress.FIRST = 0.1\n"  # s, until it says how far it is
        "from evolvent_base import cli; cli.main()"
    )
    command = [sys.executable, "-W", "ignore", "-c", program, "run", "heliogyro", *slow]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    evolvent.run("heliogyro", {"solver.duration": "0.01 s"})  # compiled before the clock starts
    process = subprocess.Popen(
        command,
        cwd=tmp_path,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # a shell starts background jobs with SIGINT ignored, and that would be inherited
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    while not (line := process.stderr.readline()).startswith("evolvent: running: "):  # it is in the time loop
        assert line, "it ended before"
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130, err
    assert "interrupted at t =" in err
    assert "interrupted: at t =" in out
    run = evolvent.open(tmp_path / "run.nc")
    assert run.attrs["status"] == "interrupted"
    assert [p.name for p in tmp_path.iterdir()] == ["run.nc"]


def test_importing_the_package_is_light():
    code = "import sys, evolvent; assert not {'numba', 'numpy', 'xarray', 'pydantic'} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_list_of_commands_has_whole_sentences(call) -> None:
    code, out, _ = call("--help")
    assert code == 0
    listed = out.partition("Commands:\n")[2]
    assert "..." not in listed
    ends = re.findall(r"(\S+)\n  (?=\S)", listed)
    assert len(ends) > 20
    assert all(word.endswith(".") for word in ends)
