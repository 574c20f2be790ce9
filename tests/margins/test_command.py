"""The command `evolvent margin`: what it prints and writes, its exit codes, and its refusals."""

import json
import pathlib

import pytest

pytestmark = pytest.mark.slow
AT_REST = ("margin", "solar-array", "--at-rest")


def test_prints_and_writes(call):
    code, out, err = call(*AT_REST, "--details", "-o", "m.json", "--figure", "m.png", "--report", "m.html")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "every margin holds"
    assert "Margins by ECSS-E-ST-33-01C" in lines
    row = next(line.split() for line in lines if line.startswith("hinge 1 "))
    assert row == ["hinge", "1", "motorization", "+5.8752", "0", "deg", "holds"]
    assert "hinge 3: what counts where its margin is least" in out
    found = json.loads(pathlib.Path("m.json").read_text())
    assert found["negative"] == []
    assert found["coordinates"]["hinge 1"]["least_margin"] == pytest.approx(5.8752, abs=1e-4)
    page = pathlib.Path("m.html").read_text()
    assert "Every margin holds" in page
    assert "hinge 2: what counts where its margin is least" in page


def test_check(call):
    slow = ("--set", "margin.lines.hinge 3.duration=10 s", "--quiet")
    assert call(*AT_REST, *slow) == (0, "", "")
    code, out, err = call(*AT_REST, *slow, "--check")
    assert (code, out, err) == (1, "", "evolvent: the margin of 'hinge 3' is below 0\n")
    assert call(*AT_REST, "--check", "--quiet")[0] == 0


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (
            ["--set", "margin.zero=[hysteresis, harness, motor losses, adhesion, load]"],
            "margin: friction of 'hinge 1' is",
        ),
        (["--set", "margin.zero=[harnes]"], "margin.zero.0 is 'harnes'; did you mean 'harness'?"),
        (["--factors", "ECSS"], "factors is 'ECSS'"),
        (["--factors", "none.yaml"], "none.yaml"),
        (["-o", "m.txt"], "'m.txt' ends with '.txt'"),
        (["--set", "margin.stations=1"], "margin.stations is 1"),
        (["--set", "margin.parts.hinge 4.category=load"], "margin.parts has 'hinge 4', which is no part"),
        (["--set", "margin.others=middle"], "margin.others is 'middle'"),
    ],
)
def test_refusals(call, words, sentence):
    code, out, err = call(*AT_REST, *words)
    assert (code, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1


def test_motion(call):
    code, out, err = call("margin", "solar-array")
    assert code == 0
    assert [line for line in err.splitlines() if "compiling" not in line] == []
    assert "Latches and stops in the run" in out
    assert "pivot 3" in out


def test_keys_of_margins_for_a_system_without_the_key(call):
    """The blade of the heliogyro: the sentence names keys that --set then takes."""
    code, _, err = call("margin", "heliogyro")
    assert code == 2
    assert "give margin.lines.reel-1.torque" in err
    zero = "margin.zero=[friction, hysteresis, harness, motor losses, adhesion, load, acceleration]"
    keys = ("blade.length=0.5 m", "blade.nodes=4", "margin.lines.reel-1.torque=50 mN m", zero)
    code, out, _ = call("margin", "heliogyro", *(word for key in keys for word in ("--set", key)))
    assert code == 0
    assert next(line for line in out.splitlines() if line.startswith("reel-1")).endswith("holds")
    code, _, err = call("margin", "heliogyro", "--set", "margin.lines.reel-1.torqe=50 mN m")
    assert code == 2
    assert "unknown key 'Margin.lines.reel-1.torqe'" in err
