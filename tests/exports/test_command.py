"""The commands `evolvent export` and `evolvent report`: what they write and how they refuse."""

import pathlib

import pytest


@pytest.mark.slow
@pytest.mark.usefixtures("sketched")
def test_writes_every_format_beside_the_run(call, files, tmp_path):
    here = tmp_path / "run.nc"
    here.write_bytes(pathlib.Path(files["rib"]).read_bytes())
    for kind, name in {
        "vtk": "run-vtk",
        "csv": "run-csv",
        "mat": "run.mat",
        "glb": "run.glb",
        "html": "run.html",
    }.items():
        code, out, err = call("export", "run.nc", "--to", kind, "--frames", "3")
        assert (code, err) == (0, "")
        assert out.startswith(f"{kind}: ")
        assert (tmp_path / name).exists()
    for kind in ("gif", "mp4"):
        code, out, _ = call("export", "run.nc", "--to", kind, "--frames", "3", "-o", f"film.{kind}")
        assert code == 0
        assert (tmp_path / f"film.{kind}").stat().st_size > 1000
    code, out, err = call("report", "run.nc")
    assert (code, err) == (0, "")
    assert out.startswith("report: run-report.html (")
    assert (tmp_path / "run-report.html").stat().st_size > 100_000


def test_a_failed_run_is_written_and_told(call, files):
    code, out, err = call("export", files["failed"], "--to", "mat", "-o", "a.mat")
    assert (code, err) == (0, "")
    assert out.splitlines()[-1].startswith("label on the files: FAILED: the energy balance is off")


def test_the_ending_of_the_output_names_a_format(call, files):
    code, out, err = call("export", files["rib"], "-o", "a.mat")
    assert (code, err) == (0, "")
    assert out.startswith("mat: a.mat")
    code, out, err = call("export", files["rib"], "-o", "motion.glb")
    assert (code, err) == (0, "")
    assert out.startswith("glb: motion.glb: ")
    code, _, err = call("export", files["rib"], "-o", "a.csv")
    assert code == 2, "tables fill a folder"
    assert "--to is not given" in err


BAD = {
    "no format": (["export", "RUN"], "--to is not given; known: csv, gif, glb, html, mat, mp4, vtk"),
    "unknown format": (["export", "RUN", "--to", "vtl"], "--to is 'vtl'; did you mean 'vtk'?"),
    "format twice": (["export", "RUN", "--to", "vtk", "--to", "csv"], "--to is given 2 times"),
    "missing file": (["export", "none.nc", "--to", "csv"], "cannot read 'none.nc': no such file or directory"),
    "no run": (["export", "text.nc", "--to", "csv"], "cannot read 'text.nc': it is not a NetCDF file"),
    "file is a folder": (["export", "folder", "--to", "mat", "-o", "folder"], "cannot read 'folder': it is a folder"),
    "output is a folder": (["export", "RUN", "--to", "mat", "-o", "folder"], "cannot write 'folder': it is a folder"),
    "output is a file": (["export", "RUN", "--to", "csv", "-o", "text.nc"], "'text.nc' is not a folder"),
    "output is the run": (["export", "RUN", "--to", "mat", "-o", "RUN"], "is the run itself; name another"),
    "folder is the run": (["export", "RUN", "--to", "vtk", "-o", "RUN"], "is the run itself; name another"),
    "no folder": (["export", "RUN", "--to", "gif", "-o", "none/a.gif"], "there is no folder 'none'"),
    "no frames": (["export", "RUN", "--to", "gif", "--frames", "0"], "invalid value for '--frames'"),
    "one frame": (["export", "RUN", "--to", "gif", "--frames", "1"], "an animation takes 2 or more"),
    "speed 0": (["export", "RUN", "--to", "gif", "--speed", "0"], "--speed is 0; it must be a number from 1e-6"),
    "speed nan": (["export", "RUN", "--to", "gif", "--speed", "nan"], "--speed is nan; it must be"),
    "speed of tables": (["export", "RUN", "--to", "csv", "--speed", "2"], "--speed is for gif, mp4, html, glb"),
    "too many a second": (
        ["export", "RUN", "--to", "gif", "--frames", "400", "--speed", "4"],
        "400 frames in 1 s are more than 50 in a second; give fewer, or a lower --speed",
    ),
    "axes": (["export", "RUN", "--to", "vtk", "--axes", "bodi"], "--axes is 'bodi'; did you mean 'body'?"),
    "axes of tables": (["export", "RUN", "--to", "csv", "--axes", "body"], "--axes is for vtk, glb, gif, mp4"),
    "decimal sign": (["export", "RUN", "--to", "csv", "--decimal", ";"], "--decimal is ';'; it must be '.' or ','"),
    "decimal sign of no table": (["export", "RUN", "--to", "mat", "--decimal", ","], "--decimal is for csv; --to mat"),
    "too large": (["export", "RUN", "--to", "gif", "--speed", "1e-3"], "may take up to"),
    "report missing": (["report", "none.nc"], "cannot read 'none.nc'"),
    "report of text": (["report", "text.nc"], "not a NetCDF file"),
    "report is a folder": (["report", "RUN", "-o", "folder"], "cannot write 'folder': it is a folder"),
    "report is the run": (["report", "RUN", "-o", "RUN"], "is the run itself; name another"),
    "report in no folder": (["report", "RUN", "-o", "none/a.html"], "there is no folder 'none'"),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_line_and_code_2(call, files, tmp_path, name):
    words, message = BAD[name]
    run = tmp_path / "run.nc"
    run.write_bytes(pathlib.Path(files["rib"]).read_bytes())
    (tmp_path / "text.nc").write_text("no run")
    (tmp_path / "folder").mkdir()
    before = run.read_bytes()
    code, out, err = call(*("run.nc" if word == "RUN" else word for word in words))
    assert (code, out) == (2, "")
    assert message in err
    assert err.count("\n") == 1
    assert sorted(p.name for p in tmp_path.iterdir()) == ["folder", "run.nc", "text.nc"]
    assert list((tmp_path / "folder").iterdir()) == []
    assert run.read_bytes() == before
