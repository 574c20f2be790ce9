"""Studies as the studio writes and draws them, without a page."""

from __future__ import annotations

import json
import pathlib

import numpy as np
import pytest
import xarray as xr

from evolvent import cases
from evolvent.design import studies
from evolvent_base.errors import InputError
from evolvent_studio import estimate, studycharts, studydraft
from evolvent_studio.folder import Folder
from evolvent_studio.studydraft import StudyDraft
from studio.serving import SHORT

RATES = {"spool.rate": [2.0, "3 rad/s"], "blade.nodes": {"from": 5, "to": 7, "points": 3}}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "short.yaml").write_text(SHORT)
    return Folder(tmp_path)


def draft(**content):
    return StudyDraft("", "", {"study": "s", "case": "short.yaml", **content})


# ------------------------------------------------------------------------------------------------ writing


@pytest.mark.parametrize(
    ("content", "count"),
    [
        ({"over": RATES}, 6),
        ({"over": {"spool.rate": [2, 3]}, "sample": "list"}, 2),
        ({"over": {"spool.rate": {"from": 2, "to": 3}}, "sample": "monte-carlo", "samples": 40}, 40),
        ({"over": {"spool.rate": {"from": 2, "to": 3}}, "sample": "latin-hypercube"}, None),
        ({"over": {}}, None),
        ({"over": {"spool.rate": {"from": 2, "to": 3}}}, None),
    ],
)
def test_the_number_of_cases_is_known_before_the_study_is_checked(content, count):
    assert studydraft.count(content) == count


def test_values_are_taken_over_when_the_sampling_changes():
    content = {"over": {"a": [1, 2, "3 m"], "b": {"from": 1, "to": 2, "points": 4}}, "sample": "grid"}
    drawn = studydraft.with_sample(content, "latin-hypercube")
    assert drawn["over"] == {"a": {"from": 1, "to": "3 m"}, "b": {"from": 1, "to": 2}}
    assert drawn["samples"] == 100
    back = studydraft.with_sample(drawn, "grid")
    assert back["over"]["a"] == {"from": 1, "to": "3 m", "points": 5}
    assert "samples" not in back
    assert studydraft.with_sample(content, "list")["over"] == {"a": [1, 2, "3 m"], "b": [1, 2]}
    assert studydraft.changed_way({"from": 1, "to": 2}, "normal") == {"mean": 1, "std": ""}


def test_a_study_is_written_in_block_style_and_read_again(folder):
    one = draft(set={"solver.duration": "0.4 s"}, over=RATES, keep=["body_rate.last", "steps"])
    text = studydraft.text(one)
    assert cases.parse_yaml(text, "s") == one.content
    assert "  spool.rate: [2.0, 3 rad/s]\n" in text
    assert "  blade.nodes: {from: 5, to: 7, points: 3}\n" in text
    assert all(len(line) <= 100 for line in text.splitlines())
    (folder.root / "s.yaml").write_text(text)
    assert studies.read(folder.root / "s.yaml").count == 6
    assert studies.read(studydraft.study_with_case(folder, one)).count == 6


@pytest.mark.slow
def test_built_in_studies_can_be_edited(folder):
    for name in studies.built_in():
        found = studydraft.opened(folder, f"case:{name}")
        assert studydraft.count(found.content) == studies.read(name).count
        assert cases.parse_yaml(studydraft.text(found), name) == cases.parse_yaml(studies.text(name), name)


def test_a_case_file_is_named_from_the_folder_of_the_study_on(folder):
    below = folder.root / "below"
    below.mkdir()
    (below / "own.yaml").write_text(SHORT)
    (below / "s.yaml").write_text(json.dumps({"study": "s", "case": "own.yaml", "over": {"blade.nodes": [5, 6]}}))
    found = studydraft.opened(folder, "file:below/s.yaml")
    assert found.content["case"] == "below/own.yaml"
    assert studies.read(studydraft.study_with_case(folder, found)).count == 2
    assert "case: own.yaml" in studydraft.text(found, pathlib.PurePosixPath("below"))
    with pytest.raises(InputError, match="save it in the folder of its case"):
        studydraft.text(draft(over={}), pathlib.PurePosixPath("below"))


def test_files_outside_are_refused(folder, tmp_path):
    (folder.root / "s.yaml").write_text(json.dumps({"study": "s", "case": "../out.yaml", "over": {"a": [1]}}))
    with pytest.raises(InputError, match="outside the working folder"):
        studydraft.opened(folder, "file:s.yaml")
    with pytest.raises(InputError, match="outside the working folder"):
        studydraft.study_with_case(folder, StudyDraft("", "", {"case": "../out.yaml"}))
    (folder.root / "none.yaml").write_text("over: {a: [1]}")
    with pytest.raises(InputError, match=r"none\.yaml: it holds no study"):
        studydraft.opened(folder, "file:none.yaml")


def test_keys_of_parts_are_offered_with_their_units(folder):
    new = studydraft.opened(folder, "new:study")
    case = studydraft.case_of(folder, new)
    keys = studydraft.keys(case)
    assert keys["parts.boom.length"][0] == "m"
    assert keys["simulate.until"][0] == "s"
    assert studydraft.value_at(case, "parts.boom.length") == "3 m"
    assert studydraft.value_at(case, "parts.hub.inertia.0") == 1.2
    assert studydraft.value_at(case, "parts.none.length") is None
    assert studydraft.keys({"system": "none"}) == {}


def test_variables_to_keep_are_offered(folder):
    found = studydraft.responses(folder, draft(over={"blade.nodes": [5, 6]}))
    assert "body_rate.last" in found
    assert studies.read(studydraft.study_with_case(folder, draft(over={"blade.nodes": [5]}, keep=found[:3]))).count == 1
    with pytest.raises(InputError, match="nodes"):
        studydraft.responses(folder, draft(over={"blade.nodse": [5, 6]}))


def test_an_estimate_computes_a_few_cases(folder):
    one = draft(set={"solver.duration": "0.4 s"}, over={"spool.rate": [2.0, 3.0, 3.5]}, keep=["steps"])
    found = estimate.estimated(studydraft.text(StudyDraft("", "", studydraft.study_with_case(folder, one))))
    assert found["computed"] == 3
    assert found["seconds"] > 0.0
    assert found["reasons"] == []
    one = draft(set={"solver.duration": "0.4 s"}, over={"solver.step": ["1e-4 s", "2e-2 s", "3e-2 s"]}, keep=["steps"])
    failed = estimate.estimated(studydraft.text(StudyDraft("", "", studydraft.study_with_case(folder, one))))
    assert 0 < len(failed["reasons"]) < failed["computed"]
    assert "stability limit" in failed["reasons"][0]


# ------------------------------------------------------------------------------------------------ dispersions


@pytest.mark.parametrize(
    ("content", "count"),
    [
        ({"over": {"a": "5%", "b": "5%"}, "sample": "corners"}, 4),
        ({"over": {"a": "5%", "b": "5%"}, "sample": "saltelli", "samples": 8}, 32),
        ({"over": {"a": "5%"}, "sample": "sobol", "samples": 16}, 16),
        ({"over": {"a": "5%"}, "sample": "sobol"}, None),
    ],
)
def test_the_number_of_runs_of_a_dispersion(content, count):
    assert studydraft.count(content) == count


def test_distributions_are_taken_over_when_the_sampling_changes():
    content = {
        "over": {"a": "table(1, 2)", "b": {"mean": "1 m", "std": "1 cm"}},
        "sample": "monte-carlo",
        "samples": 59,
    }
    found = studydraft.with_sample(content, "saltelli")
    assert found["over"] == {"a": "table(1, 2)", "b": "normal(1 m, 1 cm)"}
    assert found["samples"] == 64
    assert "samples" not in studydraft.with_sample(content, "corners")
    assert studydraft.with_sample(content, "latin-hypercube")["over"] == content["over"]
    assert studydraft.changed_way([], "text") == studydraft.FIRST_TEXT


def test_a_dispersion_reads_its_tables_in_the_folder(folder, tmp_path_factory):
    (folder.root / "below").mkdir()
    (folder.root / "below" / "rates.csv").write_text("rate (rad/s)\n3\n4\n")
    over = {"spool.rate": "table(rates.csv)"}
    content = {"study": "s", "case": "own.yaml", "sample": "monte-carlo", "samples": 5, "over": over}
    (folder.root / "below" / "own.yaml").write_text(SHORT)
    (folder.root / "below" / "s.yaml").write_text(json.dumps(content))
    found = studydraft.opened(folder, "file:below/s.yaml")
    assert found.content["over"] == {"spool.rate": "table(below/rates.csv)"}
    assert set(studydraft.read(folder, found).axes[0].values) <= {3.0, 4.0}
    assert "table(rates.csv)" in studydraft.text(found, pathlib.PurePosixPath("below"))
    outside = tmp_path_factory.mktemp("outside") / "x.csv"
    outside.write_text("3\n4\n")
    (folder.root / "link.csv").symlink_to(outside)
    for name in (str(outside), "../x.csv", "link.csv"):
        content["over"] = {"spool.rate": f"table({name})"}
        with pytest.raises(InputError, match=r"of its study, or below|is outside the working folder"):
            studydraft.read(folder, StudyDraft("", "", {**content, "case": "short.yaml"}))


# ------------------------------------------------------------------------------------------------ another case


def test_a_study_forgets_keys_of_the_case_before(folder):
    new = studydraft.opened(folder, "new:dispersion")
    content = {
        **new.content, "set": {"parts.hub.mass": 20.0, "simulate.until": "5 s"},
        "over": {"parts.boom.length": "5%", "parts.hub.mass, parts.tip mass.mass": "3%", "simulate.until": "1%"},
        "correlation": [["parts.boom.length", "simulate.until", 0.5]],
    }  # fmt: skip
    case = cases.content_of("boom-slew")
    kept = studydraft.with_case(folder, StudyDraft("", "", content), case)
    assert kept == {**content, "case": case}
    del case["parts"]["boom"]
    found = studydraft.with_case(folder, StudyDraft("", "", content), case)
    assert list(found["over"]) == ["parts.hub.mass, parts.tip mass.mass", "simulate.until"]
    assert found["keep"] == ["hub.rate.z.last"]
    assert "correlation" not in found
    other = studydraft.with_case(folder, StudyDraft("", "", content), "short.yaml")
    assert other["over"] == {"": []}
    assert not {"set", "keep", "correlation", "stages"} & set(other)
    with pytest.raises(InputError, match=r"none\.yaml"):
        studydraft.with_case(folder, StudyDraft("", "", content), "none.yaml")


# ------------------------------------------------------------------------------------------------ drawing


@pytest.fixture
def study():
    x, y = np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 7)
    smooth = 1.0 + 0.4 * x[:, None] + 0.1 * y**2
    rng = np.random.default_rng(3)
    status = np.full((9, 7), "success", dtype="<U7")
    status[2, 3] = "failed"
    reason = np.where(status == "failed", "a < b & c", "")
    values = {
        "constant": np.full((9, 7), 3.0),
        "noise": 1.0 + rng.random((9, 7)) - 0.5,
        "energy_defect_last": 1e-12 * smooth**9,
        "small": 1.0 + 1e-3 * smooth,
        "smooth": smooth,
        "order": np.where(x[:, None] > 0.5, 2.0, 3.0) + 0.0 * y,
    }
    data = {name: (("x", "y"), np.where(status == "failed", np.nan, v), {"units": "1"}) for name, v in values.items()}
    words = np.where(x[:, None] > 0.5, "taut", "slack") + np.full(7, "")
    data |= {"state": (("x", "y"), words), "status": (("x", "y"), status), "reason": (("x", "y"), reason)}
    return xr.Dataset(data, coords={"x": x, "y": y})


def test_the_first_result_shown_is_the_one_that_varies_most(study):
    names = studycharts.outputs(study, ["x", "y"])
    assert {"smooth", "state", "status"} <= set(names)
    assert "reason" not in names
    assert studycharts.most_informative(study, names, ["x", "y"]) == "smooth"
    assert studycharts.information(study, "constant", ["x", "y"]) == 0.0
    share = {name: studycharts.information(study, name, ["x", "y"]) for name in names}
    assert share["smooth"] > share["noise"] > share["small"]
    assert share["small"] > share["energy_defect_last"] * 0.5


@pytest.mark.parametrize(
    ("name", "long_name", "axis", "title"),
    [
        ("hinge_1_torque_abs_max", "hinge 1.torque: torque of the joint, largest magnitude",
         "hinge 1.torque.abs_max [N m]", "hinge 1.torque.abs_max [N m]: torque of the joint, largest magnitude"),
        ("body_rate_last", "rate of the body, at the end",
         "body rate last [N m]", "body rate last [N m]: rate of the body, at the end"),
        ("parts.hinge 1.stiffness", "parts.hinge 1.stiffness",
         "parts.hinge 1.stiffness [N m]", "parts.hinge 1.stiffness [N m]"),
        ("tip_lag", "", "tip lag [N m]", "tip lag [N m]"),
    ],
)  # fmt: skip
def test_results_are_called_as_they_were_asked_for(name, long_name, axis, title):
    variable = xr.DataArray(1.0, name=name, attrs={"units": "N m", "long_name": long_name})
    assert (studycharts.label(variable), studycharts.title(variable)) == (axis, title)


def test_the_entry_that_varies_most_is_shown_first():
    values = np.zeros((4, 3))
    values[:, 2] = [1.0, 2.0, 3.0, 4.0]
    study = xr.Dataset({"a": (("x", "sensor"), values)})
    assert studycharts.entry(study.a, ["x"]) == {"sensor": 2}
    assert studycharts.information(study, "a", ["x"]) == pytest.approx(0.75)


def test_categories_are_recognised(study):
    known = {name: studycharts.is_category(study[name]) for name in study.data_vars}
    assert {name for name, is_one in known.items() if is_one} == {"order", "state", "status", "reason", "constant"}
    assert not studycharts.is_category(xr.DataArray([1.0, 2.0, 1.0, 2.0], attrs={"units": "m"}))
    assert not studycharts.is_category(xr.DataArray([1.0, 2.0, 3.0], attrs={"units": "1"}))
    assert not studycharts.is_category(xr.DataArray([400.0, 600.0], attrs={"units": "1"}))
    assert studycharts.is_category(xr.DataArray([True, False]))
    names, places = studycharts.categories(study.order)
    assert names == ["2", "3"]
    assert places[2, 3] == -1


def reasons(study):
    return study.reason.values


@pytest.mark.parametrize("name", ["order", "state"])
def test_categories_have_a_discrete_legend(study, name):
    options, _ = studycharts.heatmap(study[name], study.x, study.y, reasons(study))
    scale = options["visualMap"]
    assert scale["type"] == "piecewise"
    assert [piece["label"] for piece in scale["pieces"]] == options["categories"]
    assert len({piece["color"] for piece in scale["pieces"]}) == 2
    assert set(options["categories"]) == ({"2", "3"} if name == "order" else {"taut", "slack"})


def test_numbers_have_a_continuous_scale_and_failed_cases_a_cross(study):
    options, at = studycharts.heatmap(study.smooth, study.x, study.y, reasons(study))
    assert options["visualMap"]["type"] == "continuous"
    assert options["visualMap"]["seriesIndex"] == 0
    cells, crosses = options["series"]
    assert cells["data"][2 * 7 + 3] == [2, 3, None]
    assert crosses["data"] == [{"value": [2, 3], "tooltip": {"formatter": "failed: a &lt; b &amp; c"}}]
    assert at(0, 17) == {"x": 2, "y": 3}
    assert at(1, 0) == {"x": 2, "y": 3}


def test_words_along_an_axis_are_bars_and_not_a_line():
    key = xr.DataArray(["a", "b", "c"], name="key", dims="key")
    values = xr.DataArray([1.0, np.nan, 3.0], name="v", dims="key", attrs={"units": "m"})
    options, at = studycharts.points(values, key, np.array(["", "broke", ""]), grid=True)
    bars, crosses = options["series"]
    assert bars["type"] == "bar"
    assert options["xAxis"]["data"] == ["a", "b", "c"]
    assert crosses["data"][0]["value"] == ["b", 0.0]
    assert at(1, 0) == {"key": 1}
    number = key.copy(data=[1.0, 2.0, 3.0])
    assert studycharts.points(values, number, np.array(["", "", ""]), grid=True)[0]["series"][0]["type"] == "line"
    rows = xr.DataArray(["slack", "taut", "taut"], name="state", dims="key")
    options, _ = studycharts.points(rows, number, np.array(["", "", ""]), grid=True)
    assert options["series"][0]["type"] == "scatter"
    assert options["yAxis"] == {"type": "category", "name": "state", "scale": True, "data": ["slack", "taut"]}


def test_lines_of_cases_open_the_case_of_a_point(study):
    options, at = studycharts.lines(study.smooth[:2], study.x[:2], study.y, np.full((2, 7), ""))
    assert len(options["series"]) == 2
    assert at(1, 3) == {"x": 1, "y": 3}
    options, at = studycharts.lines(study.smooth, study.x, study.y, reasons(study))
    assert options["series"][-1]["name"] == "failed"
    assert at(9, 0) == {"x": 2, "y": 3}
