"""The page of a day: its commands run one after another in an empty folder, and find the numbers that it states."""

import json
import pathlib
import re
import shlex

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

import evolvent
from evolvent_base import cli

PAGE = (pathlib.Path(__file__).parents[2] / "docs" / "how-to" / "day.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, flags=re.DOTALL | re.MULTILINE)


@pytest.fixture(scope="module")
def day(tmp_path_factory):
    """The folder after all commands, and what each printed, by its name; of a name that stands twice, the first."""
    pytest.importorskip("coal")
    folder, said = tmp_path_factory.mktemp("day"), dict[str, str]()
    for text in blocks("yaml"):
        (folder / text.split()[1]).write_text(text, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        for line in "".join(blocks("sh")).splitlines():
            words = shlex.split(line)[1:]
            found = CliRunner().invoke(cli.commands, words)
            assert (found.exit_code, found.exception) == (0, None), line
            said.setdefault(words[0], found.output)
    return folder, said


@pytest.mark.slow
def test_the_numbers_of_the_day(day):
    folder, said = day
    case = yaml.safe_load((folder / "flap.yaml").read_text(encoding="utf-8"))
    run = evolvent.open(folder / "flap.nc")
    peak, locked = (float(run["hinge"][name][-1]) for name in ("latch_torque_peak", "latch_time"))
    assert f"with {peak:.2f} N m" in PAGE
    assert f"at {locked:.3f} s" in PAGE
    assert "met, 5.89" in said["run"]

    inertia = 0.25**2 + (0.5**2 + 0.02**2) / 12.0  # of the flap of 1 kg about the pin
    required = 6.0 * 0.02 + 1.25 * inertia * 2.0 * np.radians(90.0) / 3.0**2
    by_hand = 0.8 * 0.3 * np.radians(40.0) / required - 1.0
    assert case["parts"]["hinge"]["rest"] == "40 deg"
    assert float(re.search(r"least margin +(\S+)", said["margin"])[1]) == pytest.approx(by_hand, abs=1e-4)
    assert f"{by_hand:+.4f}" in PAGE

    met = re.search(r"<= 6 N m .* (\d+) of 59", said["disperse"])
    lower = re.search(r"hinge\.margin .*", said["disperse"])
    assert int(met[1]) == pytest.approx(48, abs=1)  # one run is within the error of integration of the limit
    assert float(lower[0].split()[-2]) == pytest.approx(-0.035, abs=1e-3)

    better = evolvent.load(folder / "better.yaml")
    hinge = better.simulate()["hinge"]
    assert float(hinge["latch_torque_peak"][-1]) == pytest.approx(3.83, abs=0.01)
    assert float(hinge["latch_time"][-1]) <= 0.8 + 1e-4
    assert better.margin(motion=False).least == pytest.approx(0.42, abs=0.005)

    fitted = json.loads((folder / "flap-calibration" / "calibration.json").read_text(encoding="utf-8"))
    assert fitted["parameters"][0]["value"] == pytest.approx(0.08, rel=1e-3)
    assert "70 mm" in said["clearance"]


@pytest.mark.slow
def test_the_files_of_the_day(day):
    folder, _ = day
    report = (folder / "flap-report.html").read_text(encoding="utf-8")
    order = ("Limit hinge.latch_torque_peak", "Least margin", "<h2>Results", "Saved as a file")
    assert (places := [report.index(words) for words in order]) == sorted(places)
    assert (folder / "flap.glb").read_bytes()[:4] == b"glTF"
    for path in ("figures/hinge_latch_torque_peak_last.png", "flap-figures/summary.png", "flap-dispersion/report.html"):
        assert (folder / path).stat().st_size > 1000, path
