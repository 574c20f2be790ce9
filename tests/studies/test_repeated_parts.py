"""Keys of repeated parts, and of one of those that a part stands for, in every command that changes keys."""

from __future__ import annotations

import math

import numpy as np
import pytest

import evolvent
from evolvent import InputError, cases
from evolvent.design.calibration.fit import calibrate
from evolvent.design.studies.axes import annotation, value_at

#: Bobs on springs in a row: x = 1 + 0.1 cos(sqrt(k) t).
CASE = {
    "system": "structure",
    "gravity": [0, 0, 0],
    "parts": {
        "bob": {"repeat": {"count": 3, "step": [0, 1, 0]}, "kind": "point", "mass": "1 kg", "position": [1.1, 0, 0]},
        "spring": {
            "repeat": {"count": 3, "step": [0, 1, 0]}, "kind": "spring", "a": [0, 0, 0], "b": "bob {n}", "length": 1.0,
            "stiffness": "40 N/m",
        },
    },
    "simulate": {"until": "1 s", "every": "0.01 s"},
}  # fmt: skip
REPEATED, SECOND = "parts.spring.stiffness", "parts.spring 2.stiffness"


def stiffness(case):
    return [float(case.parts[f"spring {n}"].stiffness) for n in (1, 2, 3)]


def test_a_key_of_one_stands_beside_the_repeated_part():
    assert stiffness(cases.load(CASE)) == [40.0, 40.0, 40.0]
    assert stiffness(cases.load(CASE, {REPEATED: 50.0})) == [50.0, 50.0, 50.0]
    one = cases.load(CASE, {SECOND: "50 N/m"})
    assert stiffness(one) == [40.0, 50.0, 40.0]
    whole = cases.load(CASE)
    for name in ("bob 3", "spring 3", "bob 1"):  # the others are as they were
        assert one.parts[name] == whole.parts[name]
    assert stiffness(cases.load(CASE, {REPEATED: 50.0, SECOND: 60.0})) == [50.0, 60.0, 50.0]
    assert stiffness(cases.load(CASE, {SECOND: 60.0, REPEATED: 50.0})) == [50.0, 60.0, 50.0]
    content = cases.content_of(CASE, {SECOND: "50 N/m", "parts.bob 2.position.0": 1.3})
    assert content["parts"]["spring 2"] == {"stiffness": "50 N/m"}
    assert content["parts"]["bob 2"] == {"position": [1.3, 1.0, 0.0]}  # the place of this one, with one entry changed
    assert cases.load(content).parts["bob 2"].position == (1.3, 1.0, 0.0)
    assert cases.load(cases.parse_yaml(cases.to_yaml(cases.load(content), content), "case")) == cases.load(content)
    assert "repeat" in CASE["parts"]["spring"]  # the given case is not changed


def test_parts_that_are_written_out():
    content = cases.content_of(CASE, {SECOND: "50 N/m"})
    whole = cases.expanded(content)
    assert list(whole["parts"]) == [f"{name} {n}" for name in ("bob", "spring") for n in (1, 2, 3)]
    assert whole["parts"]["spring 2"] == {
        **whole["parts"]["spring 1"],
        "b": "bob 2",
        "a": [0, 1, 0],
        "stiffness": "50 N/m",
    }
    assert cases.load(whole) == cases.load(content)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"stifness": 1.0}, r"'parts.spring 2.stifness'; did you mean 'parts.spring 2.stiffness'"),
        ({"stiffness": "1 N"}, r"parts.spring 2.stiffness"),
        ({"kind": "point"}, r"the name 'spring 2' is taken by another part|parts.spring 2"),
    ],
)
def test_values_of_one_that_are_refused(given, words):
    with pytest.raises(InputError, match=words):
        cases.load({**CASE, "parts": {**CASE["parts"], "spring 2": given}})
    with pytest.raises(
        InputError, match=r"parts.spring 4.kind is missing; 'spring' stands for 'spring 1' to 'spring 3'"
    ):
        cases.load({**CASE, "parts": {**CASE["parts"], "spring 4": {"stiffness": 1.0}}})


def test_where_a_key_stands():
    kind = cases.system("structure").Case
    for key in (REPEATED, "parts.spring 1.stiffness", SECOND, "parts.spring 3.stiffness", "parts.bob 2.position.0"):
        reader, _ = annotation(kind, key, CASE)
        assert reader.unit in ("N/m", "m")
    for name in ("spring 0", "spring 4", "spring 01", "spring x"):
        with pytest.raises(InputError, match=f"no part is called '{name}'"):
            annotation(kind, f"parts.{name}.stiffness", CASE)
        with pytest.raises(InputError, match=name):
            cases.load(CASE, {f"parts.{name}.stiffness": 1.0})
    assert value_at(cases.load(CASE), REPEATED) == 40.0
    assert value_at(cases.load(CASE, {SECOND: 7.0}), SECOND) == 7.0


@pytest.mark.slow
@pytest.mark.parametrize("key", [REPEATED, SECOND, "parts.bob.mass", "parts.bob 2.position.0"])
def test_calibrate(key, tmp_path):
    """Data of bob 2 with other values: the fit finds them."""
    k, m, x0 = 52.0, 1.0, 0.1
    if "mass" in key:
        k, m = 40.0, 0.8
    if "position" in key:
        k, x0 = 40.0, 0.13
    t = np.linspace(0.0, 1.0, 21)
    rows = [f"{time},{1.0 + x0 * math.cos(math.sqrt(k / m) * time)}" for time in t]
    (tmp_path / "data.csv").write_text("time (s),x (m)\n" + "\n".join(rows) + "\n")
    found = calibrate(CASE, str(tmp_path / "data.csv"), fit=[key], observe=["bob 2.position.x=x"])
    wanted = m if "mass" in key else 1.0 + x0 if "position" in key else k
    assert found.values[0] == pytest.approx(wanted, rel=1e-4)
    assert found.parameters[0].start == {"mass": 1.0, "0": 1.1}.get(key.rpartition(".")[2], 40.0)
    assert float(value_at(cases.load(found.case), key)) == pytest.approx(wanted, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("key", [REPEATED, SECOND])
def test_studies_dispersions_and_design(key):
    keep = ["bob 1.speed.max", "bob 2.speed.max"]
    study = {"study": "x", "case": CASE, "over": {key: [36.0, 49.0]}, "keep": keep}
    swept = evolvent.sweep(study)
    assert swept["bob_2_speed_max"].values == pytest.approx([0.6, 0.7], rel=1e-2)
    assert bool(np.ptp(swept["bob_1_speed_max"].values) > 0.05) is (key == REPEATED)
    spread = evolvent.disperse(
        {"case": CASE, "sample": "monte-carlo", "samples": 4, "over": {key: "10%"}, "keep": keep}
    ).dataset
    values = spread[key].values
    assert spread["bob_2_speed_max"].values == pytest.approx(0.1 * np.sqrt(values), rel=1e-2)
    design = evolvent.optimize(CASE, vary={key: "36 to 49"}, minimize="bob 2.speed.max")
    assert design.values[key] == pytest.approx(36.0, rel=1e-3)
