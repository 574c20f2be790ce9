"""What a study asks, and how it is refused."""

import numpy as np
import pytest
import yaml

from evolvent import cases
from evolvent.design import studies
from evolvent_base.errors import InputError


def dump(study):
    """YAML of a study, its keys in their order."""
    return yaml.safe_dump(study, sort_keys=False)


def test_a_grid_has_every_combination_with_units(study):
    found = studies.read(study)
    assert found.dims == ("spool.rate", "blade.nodes")
    assert found.shape == (3, 2)
    assert found.overrides(3) == {**study["set"], "spool.rate": 3.5, "blade.nodes": 5}
    assert found.axes[0].unit == "rad/s"
    assert found.axes[0].values == (3.0, 3.5, 4.0)
    study["over"] = {"blade.length": ["4 m", "450 cm"], "blade.tip_mass": {"from": "0.1 g", "to": "1 g", "points": 1}}
    axes = studies.read(study).axes
    assert axes[0].values == (4.0, 4.5)
    assert axes[1].values == (pytest.approx(1e-4, rel=1e-15),)


def test_logarithmic_spacing_and_places_in_lists(study):
    study["over"] = {"blade.tip_mass": {"from": "1 g", "to": "100 g", "points": 3, "spacing": "log"}}
    np.testing.assert_allclose(studies.read(study).axes[0].values, [1e-3, 1e-2, 1e-1], rtol=1e-14)
    study["set"]["spool.rate"] = ["3 rad/s", "3 rad/s"]
    study["over"] = {"spool.rate.1": ["3 rad/s", "3.1 rad/s"]}
    found = studies.read(study)
    assert found.axes[0].values == (3.0, 3.1)
    assert cases.load(found.content, found.overrides(1)).spool.rate == (3.0, 3.1)


def test_a_list_goes_through_its_rows(study):
    study |= {"sample": "list", "over": {"spool.rate": [3, "4 rad/s"], "blade.nodes": [3, 5]}}
    found = studies.read(study)
    assert (found.dims, found.shape) == (("case",), (2,))
    assert found.overrides(1) == {**study["set"], "spool.rate": 4.0, "blade.nodes": 5}


@pytest.mark.slow
def test_samples_are_seeded_and_within_their_strata(study):
    study |= {"sample": "latin-hypercube", "samples": 20, "seed": 3}
    study["over"] = {"spool.rate": {"from": 3, "to": 4}, "blade.tip_mass": {"mean": "2 g", "std": "0.1 g"}}
    study["over"]["blade.nodes"] = {"from": 2, "to": 5}
    rate, mass, nodes = (np.array(axis.values) for axis in studies.read(study).axes)
    assert sorted(np.floor((rate - 3.0) * 20).astype(int)) == list(range(20))
    assert abs(mass.mean() - 2e-3) < 2e-5
    assert 0.05e-3 < mass.std() < 0.15e-3
    assert sorted(set(nodes.tolist())) == [2, 3, 4, 5]
    assert np.array_equal(rate, studies.read(study).axes[0].values)
    assert not np.array_equal(rate, studies.read(study | {"seed": 4}).axes[0].values)
    few = studies.read(study | {"sample": "monte-carlo"}).axes[0].values
    many = studies.read(study | {"sample": "monte-carlo", "samples": 30}).axes[0].values
    assert many[:20] == few


def test_every_case_has_a_seed_of_its_own(study, monkeypatch):
    monkeypatch.setattr(type(cases.system("heliogyro")), "seed_key", "body.blades")
    study["seed"] = 8
    found = studies.read(study)
    seeds = [found.overrides(index)["body.blades"] for index in range(found.count)]
    states = [np.random.SeedSequence(8, spawn_key=(k,)).generate_state(1, np.uint64)[0] for k in range(found.count)]
    assert seeds == [int(state) % 65 for state in states]
    assert len(set(seeds)) > 1
    study["set"]["body.blades"] = 2
    assert "body.blades" in studies.read(study).overrides(0)
    assert studies.read(study).seed_key == ""


def test_the_text_of_a_study_can_be_swept_again(study, tmp_path):
    found = studies.read(study)
    again = studies.read(yaml.safe_load(found.text))
    assert again.digests == found.digests
    assert again.axes == found.axes


def test_a_case_file_stands_beside_its_study(study, tmp_path):
    folder = tmp_path / "inner"
    folder.mkdir()
    (folder / "my.yaml").write_text(cases.text("heliogyro"))
    (folder / "s.yaml").write_text(dump(study | {"case": "./my.yaml"}))
    assert studies.read(folder / "s.yaml").digests == studies.read(study).digests
    (tmp_path / "my.yaml").write_text(cases.text("heliogyro"))
    for name in ("../my.yaml", str(tmp_path / "my.yaml")):
        (folder / "s.yaml").write_text(dump(study | {"case": name}))
        with pytest.raises(InputError, match="must be in the folder of its study"):
            studies.read(folder / "s.yaml")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"smaple": "grid"}, "unknown key 'smaple' in the study; did you mean 'sample'?"),
        ({"sample": "gird"}, "sample is 'gird'; did you mean 'grid'?"),
        ({"study": "../up"}, "study is '../up'; it must be a name"),
        ({"case": "heliogyr"}, "no case is called 'heliogyr'; did you mean 'heliogyro'?"),
        ({"case": 3}, "case is 3; it must be the name of a built-in case"),
        ({"set": {"blade.node": 3}}, "unknown key 'blade.node'; did you mean 'blade.nodes'?"),
        ({"set": [1]}, "set is [1]; it must be a mapping"),
        ({"over": {}}, "over is missing; it must name the keys that vary"),
        ({"over": {"blade.node": [3]}}, "over: unknown key 'blade.node'; did you mean 'blade.nodes'?"),
        ({"over": {"nodes": [3]}}, "over: unknown key 'nodes'; did you mean 'blade.nodes'?"),
        (
            {"over": {"blade.nodes": 3}},
            "over.blade.nodes is 3; with sample: grid it must be a list of values, or {from",
        ),
        ({"over": {"blade.nodes": []}}, "over.blade.nodes is []; with sample: grid it must be a list"),
        ({"over": {"blade.nodes": [3, 3]}}, "over.blade.nodes holds a value twice"),
        (
            {"over": {"blade.nodes": [3, 0]}},
            "case 1 of the study (blade.nodes: 0): blade.nodes is 0; it must be a whole",
        ),
        ({"over": {"blade.length": ["5 m", "5 kg"]}}, "blade.length is '5 kg'; it must be a length"),
        ({"over": {"blade.length": {"from": 1, "to": 2}}}, "over.blade.length.points is missing"),
        (
            {"over": {"blade.length": {"from": 1, "to": 2, "point": 3}}},
            "'over.blade.length.point'; did you mean 'points'?",
        ),
        (
            {"over": {"blade.length": {"from": 1, "to": "2 s", "points": 3}}},
            "over.blade.length.to is '2 s'; it must be a",
        ),
        (
            {"over": {"blade.length": {"from": 1, "to": 2, "points": 2.5}}},
            "over.blade.length.points is 2.5; it must be",
        ),
        ({"over": {"blade.segments": {"from": 1, "to": 2, "points": 2}}}, "over.blade.segments takes words or lists"),
        ({"over": {"spool.start_length": {"from": 0, "to": 1, "points": 2, "spacing": "log"}}}, "is not above zero"),
        ({"sample": "list"}, "over.spool.rate is {'from'"),
        ({"sample": "list", "over": {"blade.nodes": [3], "spool.rate": [3, 4]}}, "blade.nodes has 1, spool.rate has 2"),
        ({"sample": "monte-carlo"}, "samples is missing; sample: monte-carlo needs the number of cases"),
        ({"samples": 3}, "samples is given, but sample: grid takes the values"),
        ({"sample": "monte-carlo", "samples": 3}, "unknown key 'over.spool.rate.points'"),
        ({"sample": "monte-carlo", "samples": 0}, "samples is 0; it must be a whole number from 1"),
        (
            {"sample": "monte-carlo", "samples": 9, "over": {"spool.radius": {"mean": "1 cm", "std": "2 cm"}}},
            "spool.radius is -",
        ),
        ({"seed": -1}, "seed is -1; it must be a whole number from 0"),
        ({"batch": "many"}, "batch is 'many'; it must be a whole number from 1"),
        ({"keep": "body_rate"}, "keep is 'body_rate'; it must be a list of variables"),
        ({"keep": ["body_rate.lats"]}, "keep holds 'body_rate.lats'; after the variable, did you mean 'last'?"),
        ({"over": {"spool.rate": ["300 rad/s"]}, "set": {"solver.duration": "90 s"}}, "the drive outruns the thread"),
    ],
)
def test_bad_studies_are_refused_before_anything_runs(study, change, sentence):
    with pytest.raises(InputError) as refused:
        studies.read({**study, **change})
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)


def test_numbers_of_numpy_are_numbers(study):
    study["over"] = {"spool.rate": np.linspace(3.0, 4.0, 3), "blade.nodes": (np.int64(3), 5)}
    found = studies.read(study)
    assert found.axes[0].values == (3.0, 3.5, 4.0)
    assert studies.read(yaml.safe_load(found.text)).digests == found.digests
    with pytest.raises(InputError, match="the study holds <object"):
        studies.read({**study, "over": {"spool.rate": [object()]}})


def test_files_that_are_no_studies(tmp_path):
    with pytest.raises(InputError, match="no study is called 'inertia-stand-mop'"):
        studies.read("inertia-stand-mop")
    with pytest.raises(InputError, match="no such file"):
        studies.read(tmp_path / "none.yaml")
    (tmp_path / "s.yaml").write_text("study: !!python/object/apply:os.system ['touch x']")
    with pytest.raises(InputError, match=r"s\.yaml"):
        studies.read(tmp_path / "s.yaml")
    (tmp_path / "s.yaml").write_text("- 1")
    with pytest.raises(InputError, match="a study is a mapping"):
        studies.read(tmp_path / "s.yaml")
    with pytest.raises(InputError, match="not int"):
        studies.read(3)


@pytest.mark.slow
@pytest.mark.parametrize("name", studies.built_in())
def test_built_in_studies_can_be_read(name):
    assert studies.read(name).count > 1
    assert studies.built_in()[name]
    assert name not in cases.built_in()
