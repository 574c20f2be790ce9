"""The command `evolvent clearance`, and the report with clearances."""

import json
import pathlib
import sys

import numpy as np
import pytest
import xarray as xr
from PIL import Image

import cf
import evolvent
from evolvent.analysis.clearance_results import Clearances
from evolvent.exports import moving
from evolvent.exports.request import Request

WORDS = ("clearance", "solar-array", "--set", "simulate.until=2 s")


@pytest.fixture
def coal():
    return pytest.importorskip("coal")


@pytest.mark.slow
@pytest.mark.usefixtures("coal")
def test_prints_and_writes(call):
    code, out, err = call(
        *WORDS, "-o", "c.json", "--figure", "c.png", "--animation", "c.html", "--check"
    )  # fmt: skip
    assert (code, err) == (1, "evolvent: bodies interfere: panel 1 - panel 3\n")
    lines = out.splitlines()
    assert lines[0].startswith("Clearances")
    assert next(line for line in lines if line.startswith("panel 1 - panel 3")).split()[5:8] == ["-20", "mm", "0"]
    assert "'panel 1' is up to 20 mm inside 'panel 3' from t = 0 s to 1.1658 s." in lines
    found = json.loads(pathlib.Path("c.json").read_text())
    assert found["pairs"][2]["bodies"] == ["panel 1", "panel 3"]
    assert found["pairs"][2]["interference"][0]["depth"] == pytest.approx(0.02)
    assert pathlib.Path("c.png").read_bytes().startswith(b"\x89PNG")
    assert "marked" in pathlib.Path("c.html").read_text()
    clear = ("--pair", "panel 3, satellite", "--check", "--quiet", "-o", "c.nc")
    assert call(*WORDS, *clear) == (0, "clearances: c.nc\n", "")
    assert cf.faults("c.nc") == []


@pytest.mark.slow
@pytest.mark.usefixtures("coal", "sketched")
def test_a_results_file_and_its_report(call):
    run = evolvent.load("solar-array").simulate(until=2.0, every=0.05, fine=False)
    evolvent.save(run, "run.nc")
    code, out, _ = call("clearance", "run.nc")
    assert code == 0
    assert "Left out: 'satellite' and 'panel 1', held by 'pivot 1';" in out
    assert call("clearance", "run.nc", "--set", "a=1")[2] == (
        "evolvent: --set is for cases; a results file has run already\n"
    )
    assert call("report", "run.nc", "--clearance")[0] == 0
    page = pathlib.Path("run-report.html").read_text()
    assert '<a href="#clearances">Clearances</a>' in page
    assert "panel 1 - panel 3" in page
    assert call("report", "run.nc")[0] == 0
    assert "Clearances" not in pathlib.Path("run-report.html").read_text()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--pair", "panel 1"], "--pair is 'panel 1'; it must be two names of bodies"),
        (["-o", "c.txt"], "'c.txt' ends with '.txt'; clearances are written as .nc, .json"),
        (["--figure", "c.txt"], "'c.txt'"),
    ],
)
def test_refusals(call, words, sentence):
    code, out, err = call(*WORDS, *words)
    assert (code, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1


def test_without_the_package(call, monkeypatch):
    monkeypatch.setitem(sys.modules, "coal", None)
    code, out, err = call(*WORDS)
    assert (code, out) == (2, "")
    assert err == "evolvent: clearances need the package coal; pip install 'evolvent[clearance]' brings it\n"


def red(path):
    """Share of the first and the last picture of a film that has a tone of red."""
    shares = []
    with Image.open(path) as image:
        for frame in (0, image.n_frames - 1):
            image.seek(frame)
            r, g, b = np.moveaxis(np.asarray(image.convert("RGB"), dtype=float), -1, 0)
            shares.append(float(np.mean((r > 120) & (g < 0.55 * r) & (b < 0.5 * r))))
    return shares


@pytest.mark.slow
def test_films_show_bodies_that_interfere_in_red(tmp_path):
    """Until 1.2 s, by clearances that are given, and not at the end, nor in a film without clearances."""
    run = evolvent.load("solar-array").simulate(until=2.0)
    struck = xr.Dataset(
        {"between": ("interference", [0]), "start": ("interference", [0.0]), "end": ("interference", [1.2])},
        {"time": run.time.values, "a": ("pair", ["panel 1"]), "b": ("pair", ["panel 3"])},
    )
    moving.gif(run, str(tmp_path / "struck.gif"), Request(frames=5, clearance=Clearances(struck)))
    moving.gif(run, str(tmp_path / "plain.gif"), Request(frames=5))
    (first, last), plain = red(tmp_path / "struck.gif"), red(tmp_path / "plain.gif")
    assert first > 5.0 * plain[0]
    assert last < 2.0 * plain[1]


@pytest.mark.slow
@pytest.mark.usefixtures("coal")
def test_films_of_the_commands(call, monkeypatch):
    monkeypatch.setattr(moving, "_GIF", moving._GIF._replace(rate=2.0))  # few frames
    run = evolvent.load("solar-array").simulate(until=2.0, every=0.5, fine=False)
    evolvent.save(run, "run.nc")
    code, out, _ = call("export", "run.nc", "-o", "struck.gif", "--frames", "5", "--clearance")
    assert (code, out.startswith("gif: struck.gif")) == (0, True)
    assert call("clearance", "run.nc", "--quiet", "--animation", "again.gif")[0] == 0
    assert red("again.gif")[0] == pytest.approx(red("struck.gif")[0], rel=0.1)


def test_refused_films(call):
    assert call("clearance", "run.nc", "--animation", "again.avi")[2] == (
        "evolvent: --animation is 'again.avi'; its name must end in .html, .gif, .mp4\n"
    )
    assert call("export", "run.nc", "--to", "csv", "--clearance")[2] == (
        "evolvent: --clearance is for gif, mp4, html; --to csv has no colours\n"
    )
