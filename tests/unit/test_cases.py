"""Cases: found, read, overridden, refused and written back."""

import json
import re

import pytest

from evolvent import cases
from evolvent_base import schema
from evolvent_base.errors import InputError
from evolvent_papers.heliogyro import Case

PAPER = {
    "system": "heliogyro",
    "body": {"inertia": "0.004 kg m^2", "rate": "6 rad/s", "spool_offset": "0.05 m", "blades": 2},
    "blade": {
        "length": "5 m",
        "line_density": "0.735 g/m",
        "tip_mass": "0.5 g",
        "nodes": 20,
        "segments": "springs",
        "stiffness": "1e4 N/m",
        "damping": "1e-3 N s/m",
    },
    "spool": {"radius": "1 cm", "rate": "3.5 rad/s"},
    "solver": {"method": "rk4", "step": "auto"},
    "output": {"every": "0.1 s"},
}


def test_built_in_case_holds_the_papers_data():
    case = cases.load("heliogyro")
    assert case == cases.load(PAPER)
    assert (case.body.inertia, case.body.rate, case.body.spool_offset, case.body.blades) == (0.004, 6.0, 0.05, 2)
    assert case.blade.line_density == pytest.approx(7.35e-4, rel=1e-15)
    assert (case.blade.length, case.blade.tip_mass, case.blade.nodes) == (5.0, 5e-4, 20)
    assert (case.blade.stiffness, case.blade.damping) == (1e4, 1e-3)
    assert (case.spool.radius, case.spool.rate) == (0.01, 3.5)
    assert (case.solver.method, case.solver.step, case.output.every) == ("rk4", "auto", 0.1)
    assert not case.carried


def test_lists_and_texts():
    assert "heliogyro" in cases.built_in()
    assert "heliogyro" in cases.systems()
    assert cases.parse_yaml(cases.text("heliogyro"), "text") == PAPER
    with pytest.raises(InputError, match="did you mean 'heliogyro'"):
        cases.text("heliogiro")


def test_overrides_come_on_top_and_leave_the_mapping_alone():
    case = cases.load(PAPER, {"blade.nodes": 40, "body.rate": "30 rpm", "sunlight.pressure": 1e-6, "blade.width": 0.1})
    assert case.blade.nodes == 40
    assert case.body.rate == pytest.approx(3.14159265, rel=1e-8)
    assert case.sunlight.pressure == 1e-6
    assert PAPER["blade"]["nodes"] == 20
    assert "sunlight" not in PAPER


def test_a_key_of_a_named_material_is_set_beside_its_other_keys():
    content = cases.content_of("boom-slew", {"parts.boom.material": "kapton"})
    found = cases.load(content, {"parts.boom.material.density": "1 g/cm^3"}).parts["boom"].material
    assert found == cases.load(content).parts["boom"].material.replaced(density=1000.0)
    with pytest.raises(InputError, match=r"'parts\.boom\.material' is 'kaptn', which has no keys"):
        cases.content_of("boom-slew", {"parts.boom.material": "kaptn", "parts.boom.material.density": 1})


@pytest.mark.parametrize(
    "overrides",
    [
        {},
        {"body.inertia": [0.003, 0.003, 0.004], "body.motion": "free", "body.mass": "2 kg"},
        {"spool.rate": ["3.5 rad/s", "3.4 rad/s"], "spool.ramp": "2 s", "spool.start_length": "5 mm"},
        {"spool.changes": [{"time": "20 s", "rate": 0, "ramp": "1 s"}], "solver.duration": "30 s"},
        {"spool.rate": None, "spool.table": [[0, 1], ["10 s", "60 rpm"]]},
        {"sunlight": {"direction": [1, 0, 1], "specular": 0.85}, "blade.width": "10 cm"},
        {"solver.method": "dopri5", "solver.rtol": 1e-12, "output.every": 1 / 3},
    ],
)
def test_a_case_written_as_yaml_is_the_same_case(overrides):
    case = cases.load(PAPER, overrides)
    text = cases.to_yaml(case)
    assert cases.load(cases.parse_yaml(text, "text")) == case


@pytest.mark.parametrize("name", sorted(cases.built_in()))
def test_yaml_is_in_block_style_and_below_100_letters_wide(name):
    case, content = cases.load(name), cases.content_of(name)
    for text in (cases.to_yaml(case), cases.to_yaml(case, content)):
        assert cases.load(cases.parse_yaml(text, "text")) == case
        assert max(map(len, text.splitlines())) < 100
        assert "{" not in re.sub(r"\{(n[+-]?\d*)?\}", "", text), "mappings stand in block style"
    shipped = [line for line in cases.text(name).splitlines() if not line.lstrip().startswith("#")]
    assert max(len(line.partition(" #")[0]) for line in shipped) < 100


def test_yaml_keeps_units_as_they_were_written():
    content = cases.content_of(PAPER, {"blade.length": "80 cm", "blade.tip_mass": 0.001, "spool.rate": "30 rpm"})
    text = cases.to_yaml(cases.load(content), content)
    assert "length: 80 cm\n" in text
    assert "tip_mass: 0.001 kg\n" in text, "a plain number takes the unit of its key"
    assert "rate: 30 rpm\n" in text
    assert "nodes: 20\n" in text, "defaults are written out"


def test_yaml_reads_numbers_and_words_as_meant():
    content = cases.parse_yaml("{a: 1e4, b: 1.5e-3, c: -3, d: on, e: true, f: .nan, g: 010, h: 1:30, i: , j: +.5}", "x")
    assert content["a"] == 1e4
    assert isinstance(content["a"], float)
    assert content["b"] == 1.5e-3
    assert (content["c"], content["d"], content["e"]) == (-3, "on", True)
    assert content["f"] != content["f"]
    assert (content["g"], content["h"], content["i"], content["j"]) == (10, "1:30", None, 0.5)


def test_assignments():
    assert cases.parse_assignment("blade.nodes=1" + "0" * 5000) == ("blade.nodes", float("inf"))
    assert cases.parse_assignment("blade.nodes=40") == ("blade.nodes", 40)
    assert cases.parse_assignment("blade.length=5 m") == ("blade.length", "5 m")
    assert cases.parse_assignment("spool.rate=[1, 2 rpm]") == ("spool.rate", [1, "2 rpm"])
    for wrong in ("blade.nodes", "=3", "blade..nodes=3", ".a=3"):
        with pytest.raises(InputError, match=r"key\.path=value"):
            cases.parse_assignment(wrong)


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        ({"blade.nods": 20}, ["'blade.nods'", "did you mean 'blade.nodes'?"]),
        ({"nodes": 20}, ["'nodes'", "did you mean 'blade.nodes'?"]),
        ({"blades.nodes": 20}, ["'blades'", "did you mean 'blade'?"]),
        ({"spool.changes": [{"time": 1, "rat": 2}]}, ["'spool.changes.0.rat'", "did you mean 'spool.changes.rate'?"]),
        ({"blade.length": "5 kg"}, ["blade.length is '5 kg'", "a length above 0", "'5 m'"]),
        ({"blade.tip_mass": "-1 g"}, ["blade.tip_mass is '-1 g'", "0 or above"]),
        ({"blade.line_density": -1}, ["blade.line_density is -1", "above 0"]),
        ({"blade.nodes": 0}, ["blade.nodes is 0", "whole number from 1"]),
        ({"blade.nodes": 2.5}, ["blade.nodes is 2.5", "whole number"]),
        ({"blade.nodes": float("nan")}, ["blade.nodes is nan", "whole number"]),
        ({"blade.nodes": True}, ["blade.nodes is True", "whole number"]),
        ({"body.spool_offset": 0}, ["body.spool_offset is 0", "above 0"]),
        ({"body.rate": float("nan")}, ["body.rate is nan", "not finite"]),
        ({"body.motion": "fre"}, ["body.motion is 'fre'", "did you mean 'free'?"]),
        ({"body.motion": "free", "body.mass": 1, "blade.wound_mass": "ignored"}, ["blade.wound_mass", "'carried'"]),
        ({"spool.rate": [1, 2, 3]}, ["spool.rate has 3 values", "body.blades is 2"]),
        ({"spool.table": [[0, 1], [1, 2]]}, ["spool.rate and spool.table"]),
        ({"spool.rate": None, "spool.table": [[0, 1], [1, float("nan")]]}, ["spool.table.1.1 is nan", "not finite"]),
        ({"spool.start_lag": 0.1}, ["spool.start_lag", "spool.start_length"]),
        ({"sunlight": {}}, ["blade.width is missing"]),
        ({"sunlight": {"direction": [0, 0, 0]}, "blade.width": 1}, ["sunlight.direction is [0, 0, 0]", "direction"]),
        ({"solver.method": "rk5"}, ["solver.method is 'rk5'", "did you mean 'rk4'?"]),
        ({"blade.rotate_velocity": "maybe"}, ["blade.rotate_velocity is 'maybe'", "true or false"]),
        ({"body": 3}, ["body is 3", "a mapping"]),
        ({"body.rate.x": 3}, ["cannot set 'body.rate.x'", "'6 rad/s'"]),
        ({"spool.changes.0.time": 3}, ["cannot set 'spool.changes.0.time'", "is not given; give the whole list"]),
        ({"spool.rate": [3, 4], "spool.rate.2": 3}, ["'spool.rate' is a list of 2, counted from 0; it has no '2'"]),
        ({"spool.rate": None, "spool.table": [[0, 1, 2], [1, 2]]}, ["spool.table.0 is [0, 1, 2]", "2 values, not 3"]),
        ({"spool.rate": None, "spool.table": [[0], [1, 2]]}, ["spool.table.0 is [0]; it must have 2 values, not 1"]),
        ({"sunlight.direction": [0, 1]}, ["sunlight.direction is [0, 1]", "list of 3 values", "it has 2 values"]),
        ({"sunlight.direction": []}, ["sunlight.direction is []", "list of 3 values"]),
        ({"sunlight.direction": [0, 1, 2, 3]}, ["sunlight.direction is [0, 1, 2, 3]", "it has 4 values"]),
        ({"spool.rate": ["3 Hz", 3]}, ["spool.rate is ['3 Hz', 3]", "one per blade", "hertz"]),
        ({"blade.nodes": 10**400}, ["blade.nodes is 1000", "whole number"]),
        ({"blade.nodes": 10**9999}, ["blade.nodes is a number of very many digits", "whole number"]),
        ({"blade.length": -(10**400)}, ["blade.length is -1000", "not finite"]),
        ({"blade.length": 1e-320}, ["blade.length is 1e-320", "its size is not between 1e-30 and 1e+30"]),
        ({"system": None}, ["system is empty; known: "]),
        ({3: 4}, ["among the overrides the key 3 is not a word"]),
        (3, ["the overrides are 3", "a mapping of dotted keys"]),
        ([("blade.nodes", 3)], ["the overrides are [('blade.nodes', 3)]"]),
        ({"system": "helio"}, ["no system is called 'helio'", "did you mean 'heliogyro'?"]),
        ({"system": 3}, ["system is 3"]),
    ],
)
def test_refusals_are_one_sentence_that_names_the_key(overrides, words):
    with pytest.raises(InputError) as caught:
        cases.load(PAPER, overrides)
    message = str(caught.value)
    for word in words:
        assert word in message
    assert "\n" not in message


def test_missing_keys_say_what_they_want():
    content = json.loads(json.dumps(PAPER))
    del content["blade"]["length"]
    with pytest.raises(InputError, match=r"blade\.length is missing; it must be a length above 0, such as '5 m'"):
        cases.load(content)
    del content["system"]
    with pytest.raises(InputError, match=r"'system' is missing; known: .*heliogyro"):
        cases.load(content)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("open.yaml", b"body: {inertia: 3\n", "line 2, column 1"),
        ("twice.yaml", b"a: 1\na: 2\n", "line 2, column 1: the key 'a' is given twice"),
        ("binary.yaml", b"\xff\xfe\x00", "not a text file"),
        ("word.yaml", b"hello\n", "it holds 'hello'; a case is a mapping"),
        ("empty.yaml", b"# nothing\n", "it is empty; a case is a mapping"),
        ("number.yaml", b"body:\n  3: 4\n", "line 2, column 3: the key 3 is not a word"),
        ("list.yaml", b"[a]: 4\n", "the key \\['a'\\] is not a word"),
        (
            "code.yaml",
            b"a: !!python/object/apply:os.getcwd []\n",
            "the tag !python.* is not supported",
        ),
    ],
)
def test_files_that_are_no_cases(tmp_path, name, content, words):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=words) as caught:
        cases.load(path)
    assert name in str(caught.value)


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        cases.load(tmp_path / "none.yaml")
    with pytest.raises(InputError, match="it is a folder"):
        cases.load(tmp_path)
    with pytest.raises(InputError, match="no case is called 'heliogiro'; did you mean 'heliogyro'"):
        cases.load("heliogiro")
    with pytest.raises(InputError, match="not int"):
        cases.load(3)


def test_entries_of_lists_can_be_set():
    content = {**PAPER, "spool": {**PAPER["spool"], "changes": [{"time": 3, "rate": 1}]}}
    case = cases.load(content, {"spool.changes.0.rate": 2, "spool.changes.0.ramp": "1 s"})
    assert (case.spool.changes[0].rate, case.spool.changes[0].ramp) == (2.0, 1.0)
    assert content["spool"]["changes"] == [{"time": 3, "rate": 1}]
    assert cases.load(case, {"spool.changes.0.time": 4}).spool.changes[0].time == 4.0


def test_a_case_file_is_read(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(cases.text("heliogyro").replace("nodes: 20", "nodes: 7"))
    assert cases.load(str(path)).blade.nodes == 7


def test_schema_knows_every_key():
    described = cases.json_schema("heliogyro")
    for key in schema.keys(Case):
        assert json.dumps(key.rpartition(".")[2]) in json.dumps(described)
    assert described["additionalProperties"] is False


@pytest.mark.parametrize("name", cases.systems())
def test_every_system_provides_what_the_command_asks_for(name):
    module = cases.system(name)
    assert module.Case.model_fields["system"].default == name
    for function in ("plan", "numbers", "figures", "motion"):
        assert callable(getattr(module, function)), function


@pytest.mark.parametrize("name", cases.built_in())
def test_every_built_in_case_can_be_planned(name):
    case = cases.load(name)
    module = cases.system(case.system)
    assert module.plan(case).duration >= 0.0
    assert cases.built_in()[name]


def test_yaml_whose_aliases_would_fill_the_memory_is_refused():
    steps = "".join(f"a{k + 1}: &a{k + 1} [{', '.join([f'*a{k}'] * 9)}]\n" for k in range(9))
    with pytest.raises(InputError, match=r"text, line 7, column 5: it holds more than 200000 values"):
        cases.parse_yaml(f"a0: &a0 [x, x]\n{steps}", "text")
    for endless in ("a: &a [*a]", "a: &a {b: [*a]}"):
        with pytest.raises(InputError, match="an alias is inside what it names"):
            cases.parse_yaml(endless, "text")
    assert cases.parse_yaml("a: &a [1, 2]\nb: [*a, *a]", "text") == {"a": [1, 2], "b": [[1, 2], [1, 2]]}
