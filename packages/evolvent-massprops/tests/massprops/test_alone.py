"""Mass properties in an environment without the engine, without numba and without what else only that needs."""

from __future__ import annotations

import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest
import yaml

from evolvent_base import packages
from massprops import rig
from massprops.test_compound import EXAMPLE, small, swing

pytestmark = [pytest.mark.slow, pytest.mark.release]
ROOT = pathlib.Path(__file__).parents[4]
#: What the environment lacks.
LACKING = ("evolvent", "numba", "llvmlite", "xarray", "h5netcdf", "nicegui", "dask", "_")


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """A fresh environment with evolvent-base and evolvent-massprops; what they need is linked from this one."""
    folder, wheels = tmp_path_factory.mktemp("alone"), tmp_path_factory.mktemp("wheels")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(folder)], check=True)
    (site,) = folder.rglob("site-packages")
    for place in (pathlib.Path(path) for path in sys.path if path.endswith(("site-packages", "dist-packages"))):
        for path in place.iterdir():
            if not path.name.startswith(LACKING) and path.suffix != ".pth" and not (site / path.name).exists():
                (site / path.name).symlink_to(path, target_is_directory=path.is_dir())
    pip = [sys.executable, "-m", "pip", "-q", "--disable-pip-version-check"]
    sources = [str(ROOT / "packages" / name) for name in ("evolvent-base", "evolvent-massprops")]
    subprocess.run([*pip, "wheel", "--no-deps", "--no-build-isolation", "-w", str(wheels), *sources], check=True)
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    made = map(str, wheels.glob("*.whl"))
    subprocess.run(
        [*pip, "--python", str(python), "install", "--no-index", "--no-deps", "--no-compile", *made], check=True
    )
    return python.parent / "evolvent"


def call(command: list[str], folder: pathlib.Path) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command line."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, env=environment, check=False)
    return done.returncode, done.stdout, done.stderr


def test_identification_gives_the_same_as_with_the_engine(alone: pathlib.Path, tmp_path: pathlib.Path) -> None:
    rig.write_csv(tmp_path / "knock.csv", *rig.knock())
    swing(tmp_path / "swing.csv", small())
    content = yaml.safe_load(EXAMPLE.read_text(encoding="utf-8"))
    del content["tare"]
    (tmp_path / "compound.yaml").write_text(yaml.safe_dump(content))
    changes = [word for key, value in rig.SET.items() for word in ("--set", f"{key}={value}")]
    for words in (
        ["knock.csv", "--stand", str(rig.EXAMPLES / "stand.yaml"), *changes, "-o", "knock.html"],
        ["swing.csv", "--stand", "compound.yaml", "-o", "swing.html", "--figures", "figures"],
    ):
        code, out, err = call([str(alone), "identify", *words], tmp_path)
        assert code == 0, err
        assert (tmp_path / words[words.index("-o") + 1]).stat().st_size > 10_000
        here = call([sys.executable, "-c", "from evolvent_base.cli import main; main()", "identify", *words], tmp_path)
        assert here[:2] == (0, out)


def test_a_measurement_is_planned(alone: pathlib.Path, tmp_path: pathlib.Path) -> None:
    words = ["plan", str(rig.EXAMPLES / "plan.yaml"), "--uncertainty", "0.2%"]
    code, out, err = call([str(alone), *words], tmp_path)
    assert code == 0, err
    assert "release the pull at" in out


def test_what_needs_another_package_names_it(alone: pathlib.Path, tmp_path: pathlib.Path) -> None:
    lacks = "which is not installed: pip install"
    for words, sentence in {
        ("run", "boom-slew"): f"the command 'run' is of the package evolvent, {lacks} evolvent",
        ("studio",): f"the command 'studio' is of the package evolvent-studio, {lacks} evolvent-studio",
        ("plan", "inertia-stand", "--uncertainty", "1%"):
            f"there is no file 'inertia-stand', and a case needs the package evolvent, {lacks} evolvent",
        ("identify", "run.nc"): f"'run.nc' is a run of evolvent, which needs the package evolvent, {lacks} evolvent",
    }.items():  # fmt: skip
        (tmp_path / "run.nc").write_bytes(b"\x89HDF\r\n\x1a\n" + bytes(100))
        assert call([str(alone), *words], tmp_path) == (2, "", f"evolvent: {sentence}\n"), words
    code, out, _ = call([str(alone), "--help"], tmp_path)
    assert code == 0
    assert "identify" in out
    assert "modes of a CASE" not in out


def test_a_package_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packages, "folders", dict)
    assert packages.lacking("system", "heliogyro").endswith("not installed: pip install evolvent-papers")
    assert packages.lacking("case", "heliogyro-paper").startswith("the case 'heliogyro-paper' is of the package")
    assert packages.lacking("study", "inertia-stand-map").endswith("pip install evolvent-massprops")
    assert packages.lacking("case", "heliogyros") == packages.lacking("command", "fly") == ""
    assert np.all([packages.lacking("command", name) for name in ("fmu", "studio", "plan", "validate", "run")])
