"""Structures in the studio without a browser: forms of parts, names and references, the start, runs as trees."""

from __future__ import annotations

import json
import pathlib
import time

import numpy as np
import pytest

import evolvent
from evolvent import cases, results
from evolvent.parts.base import Group, Part, Reference
from evolvent.parts.registry import kinds
from evolvent.results import variables
from evolvent.view import show
from evolvent_base import schema
from evolvent_base.errors import InputError
from evolvent_base.schema import OneOf, marks, sections
from evolvent_studio import charts, form, kindgroups, parts, preview, reading
from evolvent_studio.assemblies import HingedPanel
from evolvent_studio.drafts import Draft, View, view_of
from evolvent_studio.folder import Folder
from evolvent_studio.state import NEW, Studio

STRUCTURES = [name for name in cases.built_in() if cases.content_of(name)["system"] == "structure"]
HUB = {"kind": "rigid-body", "mass": "20 kg", "inertia": [1.2, 1.2, "2 kg m^2"], "points": {"left": [0.2, 0, "0 m"]}}
BOOM = {"kind": "beam", "length": "3 m", "section": {"circle": "1 cm"}, "material": "aluminium", "elements": 4}


@pytest.fixture
def studio(tmp_path):
    """A studio of an empty folder."""
    made = Studio(Folder(tmp_path))
    yield made
    made.jobs.stop()


# ------------------------------------------------------------------------------------------------ form


@pytest.mark.parametrize("name", STRUCTURES)
def test_forms_of_parts_give_back_every_built_in_structure(name):
    content = cases.content_of(name)["parts"]
    assert parts.problems(content) == {}
    for part in content.values():
        shown = form.describe(parts.kind_of(part), skip=("kind",), flat=True, repeats="repeat" in part)
        back, wrong = form.content_of(shown, form.texts(shown, part), form.given(shown, part))
        assert wrong == {}
        assert {"kind": part["kind"], **back} == part


@pytest.mark.parametrize("kind", kinds())
def test_form_of_a_part_has_every_key_once(kind):
    shown = form.describe(kinds()[kind], skip=("kind",), flat=True)
    fields = list(shown.fields())
    assert {field.key.partition(".")[0] for field in fields} == set(kinds()[kind].model_fields) - {"kind"}
    assert shown.help
    texts = schema.descriptions(kinds()[kind])
    for field in fields:
        assert field.help or field.choices or not texts.get(field.key)
        assert "values in brackets, each a list" not in field.help


def test_fields_of_a_beam_show_units_limits_and_how_mappings_are_written():
    fields = {field.key: field for field in form.describe(kinds()["beam"], flat=True).fields()}
    assert fields["length"].unit == "m"
    assert "a length above 0" in fields["length"].help
    assert fields["section"].wide
    assert "{tube: {radius: ..., thickness: ...}}" in fields["section"].help
    assert "Linearly elastic: {young_modulus, poisson_ratio, density}, or aluminium" in fields["material"].help
    assert "one of the names aluminium, beryllium-copper, cfrp" in fields["material"].help
    assert "from 1 to 100000" in fields["elements"].help
    joint = {field.key: field for field in form.describe(kinds()["joint"], flat=True).fields()}
    assert [key for key, field in joint.items() if field.refers] == ["a", "b", "over", "joints", "released_by"]


def test_storage_and_relaxation_have_forms():
    content = cases.content_of("hinge-stored")
    shown = form.describe(cases.system("structure").Case, skip=("system", "parts"))
    fields = {field.key: field for field in shown.fields()}
    assert (fields["store.time"].unit, fields["store.temperature"].unit) == ("s", "K")
    assert fields["store.temperature"].help.endswith("or rows [time (s), absolute temperature (K)]")
    assert form.texts(shown, content)["store.time"] == "10 years"
    typed = {"store.time": "1 year", "store.temperature": "[[0 days, 20 degC], [400 days, 40 degC]]"}
    found, wrong = form.content_of(shown, typed, {"store"})  # as where a case has none before
    assert (wrong, found["store"]["temperature"][1]) == ({}, ["400 days", "40 degC"])
    assert cases.problems({**content, **found}) == {}
    falling = {**content, "store": {"time": "1 year", "temperature": [["1 day", "20 degC"], ["0 s", "40 degC"]]}}
    assert list(cases.problems(falling)) == ["store.temperature"]

    shown = form.describe(kinds()["joint-spring"], skip=("kind",), flat=True)
    fields = {field.key: field for field in shown.fields()}
    assert form.given(shown, content["parts"]["hinge"]) == {"viscoelastic"}
    assert fields["viscoelastic.prony"].help.endswith("rows [plain number, time (s)]")
    assert "{arrhenius: {energy: ..., reference: ...}}" in fields["viscoelastic.shift"].help
    assert form.texts(shown, content["parts"]["hinge"])["viscoelastic.prony"].startswith("[[0.08, 1 h]")
    typed = form.texts(shown, content["parts"]["hinge"]) | {"viscoelastic.prony": "[[0.6, 1 h], [0.5, 1 h]]"}
    found, _ = form.content_of(shown, typed, {"viscoelastic"})
    (wrong,) = parts.part_problems("hinge", {"kind": "joint-spring", **found}).items()
    assert wrong[0] == "viscoelastic.prony"
    assert "they must sum to less than 1" in wrong[1]


def test_a_choice_of_numbers_is_a_number():
    shown = form.describe(kinds()["joint"], flat=True)
    sense = next(field for field in shown.fields() if field.key == "sense")
    assert sense.choices == ("1", "-1")
    content, wrong = form.content_of(shown, {"sense": "-1"}, set())
    assert (content, wrong) == ({"sense": -1}, {})


def test_what_is_wrong_stands_beside_its_key():
    content = {
        "hub": HUB | {"mass": "20 m"},
        "boom": BOOM | {"lenght": 3, "section": {"circle": "1 kg"}},
        "clamp": {"kind": "joynt"},
        "thing": {"mass": 1},
        "1st": HUB,
    }
    found = parts.problems(content)
    assert set(found) == {
        "parts.hub.mass", "parts.boom.lenght", "parts.boom.section.circle.radius", "parts.clamp", "parts.thing",
        "parts.1st",
    }  # fmt: skip
    assert "did you mean 'length'" in found["parts.boom.lenght"]
    assert "did you mean 'joint'" in found["parts.clamp"]
    assert "kind is missing" in found["parts.thing"]
    shown = form.describe(kinds()["beam"], skip=("kind",), flat=True)
    assert form.nearest_field(shown, "section.circle.radius") == "section"
    assert form.nearest_field(shown, "lenght") == ""
    shown = form.describe(cases.system("heliogyro").Case)
    assert form.nearest_field(shown, "blade") == "blade"
    assert form.nearest_field(shown, "blade.tip_mas") == "", "no field of the section shows it"


def test_sentences_of_the_assembly_stand_beside_their_key():
    content = {"hub": HUB, "boom": BOOM, "tip mass": {"kind": "point", "mass": 1, "at": "bom.tip"}}
    assert parts.named_in("'tip mass' refers to 'bom', but no part is called that", content) == "tip mass.at"
    assert parts.named_in("boom.direction is (0, 0, 0); it must not be zero", content) == "boom.direction"
    assert parts.named_in("'hub' turns too fast", content) == "hub"
    assert parts.named_in("nothing of all this", content) == ""


# ------------------------------------------------------------------------------------------------ names


def test_references_follow_a_name():
    content = {
        "hub": HUB,
        "boom": BOOM,
        "boom 2": BOOM,
        "clamp": {"kind": "joint", "a": "hub.left", "b": "boom.root", "type": "clamp"},
        "tip": {"kind": "point", "mass": 1, "at": "boom[4]"},
        "spring": {"kind": "spring", "a": ["hub", [0, 0, 1]], "b": "boom 2"},
        "drum": {"kind": "contact", "a": ["boom", "boom 2"], "b": "hub"},
        "crossing": {"kind": "event", "law": "z", "variables": {"z": "boom.tip.position.z", "w": "hub.rate.z"}},
    }
    found = parts.renamed(content, "boom", "mast")
    assert list(found) == ["hub", "mast", *list(content)[2:]]
    assert found["clamp"]["b"] == "mast.root"
    assert found["clamp"]["type"] == "clamp"
    assert found["tip"]["at"] == "mast[4]"
    assert found["spring"]["b"] == "boom 2"
    assert found["drum"]["a"] == ["mast", "boom 2"]
    assert found["crossing"]["variables"] == {"z": "mast.tip.position.z", "w": "hub.rate.z"}
    found = parts.renamed(found, "hub", "bus")
    assert found["clamp"]["a"] == "bus.left"
    assert found["spring"]["a"] == ["bus", [0, 0, 1]]
    assert found["drum"]["b"] == "bus"
    assert content["clamp"]["a"] == "hub.left", "what was there is not changed"
    assert parts.referring(content, "boom") == ["clamp", "tip", "drum", "crossing"]


def _nested(kind, path=()):
    """Paths of keys to the references in the sections of a class of parts."""
    for key, field in kind.model_fields.items():
        if path and any(isinstance(mark, Reference) for mark in marks(field)):
            yield (*path, key)
        inside = [((key,), section) for section in sections(field.annotation)]
        for choice in (one for one in marks(field) if isinstance(one, OneOf)):
            inside += [((key, word), section) for word, section in choice.kinds.items()]
        for at, section in inside:
            yield from _nested(section, (*path, *at))


def test_references_within_sections_of_a_part_follow():
    found = [(name, path) for name, kind in kinds().items() for path in _nested(kind)]
    assert ("net", ("ties", "anchors", "to")) in found
    for name, path in found:
        content = "hub"
        for key in reversed(path):
            content = {key: content}
        content = {"hub": HUB, "one": {"kind": name, **content}}
        value = parts.renamed(content, "hub", "bus")["one"]
        assert parts.referring(content, "hub") == ["one"]
        for key in path:
            value = value[key]
        assert value == "bus", path


#: Structures that take a second to start, and of whose kinds of parts others consist, too.
LONG = {"miura-sheet", "net-reflector", "rib-antenna-wound", "rib-lenticular-shell", "ring-antenna", "tape-hinge-shell"}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.release] if name in LONG else []) for name in STRUCTURES]
)
def test_a_renamed_structure_starts_as_before(name):
    content = cases.content_of(name)
    before = preview.start_of(content)
    for old in list(content["parts"]):
        content["parts"] = parts.renamed(content["parts"], old, f"{old} of it")
    after = preview.start_of(content)
    length = int.from_bytes(before[:4], "little")
    other = int.from_bytes(after[:4], "little")
    assert after[4 + other :] == before[4 + length :]
    assert b" of it" in after[4 : 4 + other]


def test_names_are_proposed_and_refused():
    assert parts.proposed_name({}, "rigid-body") == "rigid body"
    assert parts.proposed_name({"beam": BOOM}, "beam") == "beam 2"
    assert parts.proposed_name({"beam": BOOM, "beam 2": BOOM}, "beam 2") == "beam 3"
    assert list(parts.added({"hub": HUB}, " boom ", BOOM)) == ["hub", "boom"]
    refused = {"hub": "already taken", "1st": "start with a letter", "a.b": "letters", "ground": "use another"}
    for name, said in refused.items():
        with pytest.raises(InputError, match=said):
            parts.added({"hub": HUB}, name, BOOM)
        if name != "hub":
            with pytest.raises(InputError, match=said):
                parts.renamed({"hub": HUB}, "hub", name)
    with pytest.raises(InputError, match="did you mean 'beam'"):
        parts.added({}, "boom", {"kind": "beem"})
    assert parts.renamed({"hub": HUB}, "hub", "hub ") == {"hub": HUB}
    assert parts.words({"hub": HUB, "boom": BOOM}) == ["hub", "hub.left", "boom", "boom.root", "boom.tip", "ground"]


# ------------------------------------------------------------------------------------------------ start


def test_the_start_is_that_of_the_parts():
    content = {
        "system": "structure",
        "parts": {"hub": HUB, "boom": BOOM | {"position": [0.2, 0, 0], "direction": [0, 0, 1]}},
    }
    packed = preview.start_of(content)
    size = int.from_bytes(packed[:4], "little")
    header = json.loads(packed[4 : 4 + size])
    assert [line["name"] for line in header["lines"]] == ["boom"]
    assert [frame["name"] for frame in header["frames"]] == ["hub"]
    assert header["colors"] == [], "no strain is known before the run"
    assert header["forces"] == []
    at = 4 + size
    for block in header["blocks"]:
        count = int(np.prod(block["shape"]))
        kind = {"f4": "<f4", "f8": "<f8"}[block["type"]]
        values = np.frombuffer(packed, kind, count, at).reshape(block["shape"])
        at += values.nbytes
        if block["name"] == "line 0":
            assert values.shape[0] == 1
            assert np.allclose(values[0, [0, -1]], [[0.2, 0, 0], [0.2, 0, 3.0]], atol=1e-6)
    assert at == len(packed)


def test_the_start_of_a_plate_is_a_surface_without_colours():
    packed = preview.start_of(cases.content_of("plate-swing"))
    header = json.loads(packed[4 : 4 + int.from_bytes(packed[:4], "little")])
    (surface,) = header["surfaces"]
    assert (surface["name"], surface["values"], surface["thickness"]) == ("plate", {}, pytest.approx(2e-3))
    assert len(surface["faces"]) == 4 * 64 * surface["each"]
    assert header["colors"] == []


def test_why_there_is_no_start_is_one_sentence(studio):
    content = cases.content_of("boom-slew")
    content["parts"]["clamp"]["a"] = "hubb.bracket"
    with pytest.raises(InputError, match=r"'clamp' refers to 'hubb'.* did you mean 'hub'"):
        studio.start(content)
    content = {"system": "structure", "parts": {"push": {"kind": "load", "at": [0, 0, 0], "force": [0, 0, 1]}}}
    with pytest.raises(InputError):
        studio.start(content)
    with pytest.raises(InputError, match="the system has no parts"):
        studio.start({"system": "structure", "parts": {}})


def test_a_part_that_fails_in_another_way_is_one_sentence_too(monkeypatch):
    def fail(self, builder, name):
        raise ValueError("no way\nat all")

    monkeypatch.setattr(kinds()["load"], "write", fail)
    with pytest.raises(InputError, match="the start cannot be drawn: ValueError: no way at all"):
        preview.start_of(cases.content_of("boom-slew"))


def test_starts_are_kept_for_a_while(studio):
    name = studio.start(cases.content_of("boom-slew"))
    assert studio.start_of(name) == preview.start_of(cases.content_of("boom-slew"))
    assert studio.start_of("other") is None
    content = cases.content_of("yo-yo-despin")
    assert studio.start(content) != name
    assert studio.start(cases.content_of("boom-slew")) == name


def test_a_new_structure_is_a_case(studio):
    for name in NEW:
        studio.open_case(f"new:{name}")
        assert cases.problems(studio.draft.content) == {}
        assert studio.start(studio.draft.content)
    assert {"new:structure", "case:boom-slew", "case:heliogyro"} <= set(studio.sources())


# ------------------------------------------------------------------------------------------------ runs


@pytest.mark.slow
def test_a_run_of_a_structure_has_numbers_figures_motion_and_variables(studio):
    content = cases.content_of("boom-slew", {"simulate.until": "0.4 s"})
    run = evolvent.run(content)
    results.save(run, studio.folder.root / "slew.nc")
    loaded = studio.load("file:slew.nc")
    assert {"Beam", "Energy balance"} <= {figure.title for figure in loaded.figures}
    assert any(number.label == "boom.tip_deflection" for number in loaded.numbers)
    assert len(studio.motion("file:slew.nc")) > 1000
    assert "parts:" in studio.case_text("file:slew.nc")
    names = variables.names(loaded.run)
    assert {"energy", "hub.rate", "boom.tip_deflection"} <= set(names)
    figure = show.figure(loaded.run, ["hub.rate", "boom.tip_deflection", "boom.deflection"])
    drawn = charts.charts(figure)
    assert len(drawn) == 2
    assert all(chart.timed for chart in drawn)
    for name in names:  # whatever is offered can be drawn
        json.dumps([chart.options for chart in charts.charts(show.figure(loaded.run, [name]))], allow_nan=False)
    assert pathlib.Path(loaded.path).name == "slew.nc"


# ------------------------------------------------------------------------------------------------ equilibria, modes

STRIP = {
    "parts": {
        "boom": BOOM,
        "wall": {"kind": "joint", "a": [0, 0, "0 m"], "b": "boom.root", "type": "clamp"},
        "weight": {"kind": "load", "at": "boom.tip", "force": [0, 0, "-1 N"]},
    }
}


def wait(studio, key):
    """Wait until a job has ended; returns it."""
    for _ in range(1200):
        if not studio.jobs.get(key).open:
            return studio.jobs.get(key)
        time.sleep(0.1)
    raise AssertionError(studio.jobs.get(key))


@pytest.mark.slow
def test_equilibria_and_modes_wait_in_the_queue_and_are_kept(studio):
    draft = Draft("file:strip.yaml", "strip.yaml", cases.content_of(STRIP))
    keys = {kind: studio.submit(draft, kind) for kind in ("equilibrium", "modes")}
    rest, found = (wait(studio, key) for key in keys.values())
    assert [job.status for job in (rest, found)] == ["success", "success"]
    loaded = studio.load(f"job:{keys['equilibrium']}")
    assert loaded.still
    assert [figure.title for figure in loaded.figures] == ["Along boom"]
    for figure in loaded.figures:
        json.dumps([chart.options for chart in charts.charts(figure)], allow_nan=False)
    assert studio.motion(f"job:{keys['equilibrium']}")
    system = evolvent.load(STRIP)
    np.testing.assert_allclose(loaded.run["boom"].tip_position, system.equilibrium()["boom"].tip_position)
    modes = system.modes()
    assert [float(row[1]) for row in found.extra["rows"]] == pytest.approx(modes.frequency_hz, rel=1e-4)
    assert len(found.extra["head"]) == len(found.extra["rows"][0]) == 10
    ref = f"job:{keys['modes']}"
    assert b'"repeats":true' in studio.mode(f"{ref}:3")
    for wrong in (f"{ref}:10", f"{ref}:-1", f"{ref}:x", f"{ref}:", f"{ref}:../3"):
        assert studio.mode(wrong) is None
    assert studio.path(ref).name == "modes.nc"
    assert [view_of(job) for job in (rest, found)] == [
        View("run", (f"job:{keys['equilibrium']}",)), View("modes", (ref,)),
    ]  # fmt: skip


@pytest.mark.slow
def test_a_stored_case_runs(studio):
    draft = Draft("case:hinge-stored", "", cases.content_of("hinge-stored"))
    job = wait(studio, studio.submit(draft))
    assert job.status == "success"
    loaded = studio.load(f"job:{job.key}")
    assert float(loaded.run["hinge"].torque.values[0]) < 0.75 * 0.2 * np.radians(150.0)


def test_what_has_no_modes_is_refused_before_it_waits(studio):
    reel = {"kind": "reel", "body": "hub", "radius": 0.1, "drive": {"free": {"inertia": 1e-3, "angle": 5.0}}}
    thread = {"kind": "thread", "reel": "reel", "length": 1, "line_density": 0.1, "nodes": 5}
    thread |= {"segments": "inextensible"}
    content = cases.content_of({"parts": {"hub": HUB | {"motion": "driven"}, "reel": reel, "thread": thread}})
    for kind, words in (("modes", "modes do"), ("equilibrium", "equilibrium does")):
        with pytest.raises(InputError, match=f"'thread' is a thread .* which {words} not support; for an eq"):
            studio.submit(Draft("", "", content), kind)
    assert studio.jobs.listed() == []


# ------------------------------------------------------------------------------------------------ keys that apply


@pytest.mark.parametrize("kind", kinds())
def test_conditions_of_a_part_name_its_keys_and_values(kind):
    part = kinds()[kind]
    for key, conditions in part.applies.items():
        assert key in part.model_fields
        for when in conditions:
            assert set(when.keys) <= set(part.model_fields) - {key}
            assert not when.values or len(when.keys) == 1
            field = next(one for one in form.describe(part, flat=True).fields() if one.key == when.keys[0])
            assert set(when.values) <= {*field.choices, *(() if field.required or field.default else ("",))}


def test_fields_of_a_load_follow_what_is_given():
    fields = form.describe(kinds()["load"], flat=True).fields()
    of_load = {field.key: field for field in fields}

    def shown(**texts):
        return {key for key, field in of_load.items() if field.applies(texts, {})}

    assert {"at", "along", "type", "force", "torque", "law"} <= shown()
    assert not {"slope", "pitch", "constants"} & shown()
    assert {"force", "along", "slope"} & shown(at="boom.tip", torque="[0, 0, 1]") == {"slope"}
    assert {"force", "direction", "at", "pitch"} & shown(along="boom", type="torque") == {"pitch"}
    assert {"force", "torque", "axis", "constants"} & shown(at="hub", law="[x, y, z]") == {"constants"}


@pytest.mark.parametrize("name", cases.built_in())
def test_keys_of_built_in_cases_apply(name):
    for part, content in cases.content_of(name).get("parts", {}).items():
        kind = parts.kind_of(content)
        values = {key: field.default for key, field in kind.model_fields.items() if isinstance(field.default, str)}
        for key in set(content) & set(kind.applies) - set(kind.always_allowed):
            assert all(when.holds(values | content) for when in kind.applies[key]), f"{part}.{key}"


def test_every_kind_is_in_the_group_that_it_states():
    groups = dict(kindgroups.grouped())
    assert sorted(kind for names in groups.values() for kind in names) == sorted(kinds())
    assert list(groups) == [str(group) for group in Group if group != Group.OTHERS]  # every kind of the package says it
    assert groups["springs and resistances"] == ["bearing", "joint-spring", "resistance", "spring"]


def test_groups_of_other_packages(monkeypatch):
    """Those of the package first, then a package's own, then kinds that state none."""
    own = {"sail": type("Sail", (Part,), {"group": "sails"}), "hoop": type("Hoop", (Part,), {})}
    monkeypatch.setattr(kindgroups, "kinds", lambda: {"point": kinds()["point"]} | own)
    found = [("bodies, beams and threads", ["point"]), ("sails", ["sail"]), ("of other packages", ["hoop"])]
    assert list(kindgroups.grouped()) == found


# ------------------------------------------------------------------------------------------------ several parts

PANEL = {"body": "hub", "hinge": [0.3, 0, "0.1 m"], "size": [2, 0.5, "0.02 m"], "mass": "3 kg"}


def test_a_panel_on_a_hinge_lies_and_opens_as_asked():
    asked = HingedPanel.model_validate(
        PANEL | {"direction": [0, 2, 0], "axis": [1, 0, 0], "stiffness": "1 N m/rad", "opens": "90 deg"}
    )
    found = asked.parts("wing")
    assert list(found) == ["wing", "wing hinge", "wing spring"]
    assert parts.problems(found) == {}
    still = {"kind": "rigid-body", "motion": "driven"}
    run = evolvent.run({"parts": {"hub": still, **found}, "simulate": {"until": "0.01 s"}})
    np.testing.assert_allclose(run["wing"].position[0], [0.3, 1.0, 0.1])
    inertia = 3.0 * (2.0**2 + 0.02**2) / 12.0 + 3.0  # about the hinge
    torque = 0.5 * np.pi  # 1 N m/rad times 90 deg
    np.testing.assert_allclose(run["wing"].rate.values[-1] @ [0, 1.0, 0], torque / inertia * 0.01, rtol=1e-4)


@pytest.mark.parametrize(
    ("change", "said"),
    [({"axis": [1, 0, 1]}, "must be perpendicular to direction"), ({"opens": "90 deg"}, "needs a stiffness")],
)
def test_a_panel_that_cannot_be_is_refused(change, said):
    assert any(said in text for text in cases.problems(PANEL | change, HingedPanel).values())
    with pytest.raises(InputError, match=said):
        HingedPanel(**PANEL | change)


def test_a_repeated_part_is_checked_renamed_and_counted():
    rib = BOOM | {"position": [0.2, 0, "0 m"], "normal": [0, 0, 1], "repeat": {"count": 6, "axis": [0, 0, 1]}}
    clamp = {"kind": "joint", "a": "hub", "b": "rib {n}.root", "type": "clamp", "repeat": {"count": 6}}
    content = {"hub": HUB, "rib": rib, "clamp": clamp, "tip": {"kind": "point", "mass": 1, "at": "rib 2.tip"}}
    assert parts.problems(content) == {}
    assert reading.elements({"parts": content}) == 24
    assert {"rib {n}", "rib {n}.root", "clamp {n}", "hub"} <= set(parts.words(content))
    after = parts.renamed(content, "rib", "blade")
    assert (after["clamp"]["b"], after["tip"]["at"]) == ("blade {n}.root", "blade 2.tip")
    assert parts.referring(content, "rib") == ["clamp", "tip"]
    assert preview.start_of({"system": "structure", "parts": after})
    wrong = {
        "repeat": ({"step": [1, 0, 0]}, "repeat.count"),
        "two": ({"count": 3, "step": [1, 0, 0], "axis": [0, 0, 1]}, "repeat.step"),
        "lone": ({"count": 3, "angle": "60 deg"}, "repeat.axis"),
        "word": ("six", "repeat"),
    }
    for repeat, key in wrong.values():
        assert list(parts.part_problems("rib", rib | {"repeat": repeat})) == [key]
    bare = {key: value for key, value in rib.items() if key != "normal"}
    with pytest.raises(InputError, match=r"parts\.rib\.normal is missing") as error:
        preview.start_of({"system": "structure", "parts": {"hub": HUB, "rib": bare}})
    assert parts.named_in(str(error.value), {"hub": HUB, "rib": bare}) == "rib.normal"


def test_a_repeated_part_is_written_once():
    bob = {"kind": "point", "mass": "1 kg", "repeat": {"count": 3, "step": [0, 0, "50 cm"]}}
    content = cases.content_of({"parts": {"hub": HUB, "bob": bob}})
    case = cases.load(content)
    written = cases.parse_yaml(cases.to_yaml(case, content), "case")
    assert list(written["parts"]) == ["hub", "bob"]
    assert written["parts"]["bob"]["repeat"] == bob["repeat"]
    assert cases.load(written) == case
