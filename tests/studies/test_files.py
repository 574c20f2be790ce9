"""Results are kept under the content of the files that a case names, whatever they are called."""

from __future__ import annotations

import dataclasses
import importlib.metadata
import os
import pathlib
from collections.abc import Iterator

import numpy as np
import pytest

import evolvent as ev
from evolvent import InputError, cases, parts
from evolvent.design import calibration, studies
from evolvent.design.evaluator import sources
from evolvent.design.evaluator.evaluator import Evaluator
from evolvent.design.optimization import problem
from evolvent.design.optimization.runs import Designs
from evolvent.design.studies import study
from evolvent.design.studies.runner import Points, runs_of
from evolvent.elements.reduced_files import read_model, write_model
from evolvent.parts import registry
from evolvent_base import file_keys, plugins, safe_open, schema


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def table(scale: float, name: str = "t.csv") -> None:
    rows = (f"{a},{scale * 0.002 * a}" for a in (-180, 0, 90, 180))
    pathlib.Path(name).write_text("angle (deg),torque (N m)\n" + "\n".join(rows))


def model(scale: float, name: str = "own.npz") -> None:
    found = read_model("solar-panel")
    write_model(name, dataclasses.replace(found, mass=scale * found.mass, stiffness=scale * found.stiffness))


def hinge(torque: str = "t.csv") -> dict:
    found = {
        "panel": {"kind": "rigid-body", "motion": "spin", "inertia": "0.8 kg m^2"},
        "hinge": {
            "kind": "joint-spring", "a": "ground", "b": "panel", "start": "90 deg", "stiffness": "0.3 N m/rad",
            "rest": "-90 deg",
        },
        "harness": {"kind": "resistance", "type": "harness", "joint": "hinge", "torque": torque},
    }  # fmt: skip
    return {"system": "structure", "parts": found, "simulate": {"until": "2 s", "every": "0.5 s"}}


PANEL = {
    "system": "structure",
    "parts": {"b": {"kind": "reduced-body", "file": "own.npz"}},
    "simulate": {"until": "0.1 s", "every": "0.05 s"},
}


def paths(kind: type[schema.Section], before: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], object]]:
    """Path and mark of every key of a section, and of those within it, that a file may stand in."""
    for key, field in kind.model_fields.items():
        inner = [((), one) for one in schema.sections(field.annotation)]
        for mark in schema.marks(field):
            if isinstance(mark, file_keys.FileKey):
                yield (*before, key), mark
            inner += [((name,), one) for name, one in mark.kinds.items()] if isinstance(mark, schema.OneOf) else []
        for name, one in inner:
            yield from paths(one, (*before, key, *name))


def marked() -> list[tuple[dict, file_keys.FileKey]]:
    """Every key of the schema that a file may stand in, as a case with a place for its name, and its mark."""
    found = []
    every = [((), name, {}, cases.system(name).Case) for name in cases.systems()]
    every += [(("parts", "x"), "structure", {"kind": name}, kind) for name, kind in registry.kinds().items()]
    for before, system, beside, kind in every:
        for path, mark in paths(kind):
            value: object = "NAME"
            for depth, word in enumerate(reversed((*before, *path))):
                value = {word: value} | (beside if depth == len(path) - 1 else {})
            found.append(({"system": system, **value}, mark))
    return found


def named(content: object, name: str) -> object:
    if isinstance(content, dict):
        return {key: named(one, name) for key, one in content.items()}
    return name if content == "NAME" else content


def test_every_key_of_a_file_is_known_by_content():
    every = marked()
    assert len(every) >= 8
    for k, (content, mark) in enumerate(every):
        name = f"f{k}{(mark.endings or ('.npz',))[0]}"
        case, before = named(content, name), None
        for text in ("one", "two"):
            status = os.stat(name) if before else None
            pathlib.Path(name).write_text(text)  # of the same size, and below of the same time
            if status is not None:
                os.utime(name, ns=(status.st_atime_ns, status.st_mtime_ns))
            found = cases.files_of(case)
            assert set(found) == {name}
            assert len(found[name]) == 64
            assert found != before
            before = found
        os.remove(name)
        assert cases.files_of(case) == {name: ""}


def test_every_file_that_a_case_reads_is_marked(monkeypatch):
    table(1.0)
    model(1.0)
    table(2.0, "n 1.csv")
    table(3.0, "n 2.csv")
    opened: list[str] = []
    real = safe_open.binary

    def noting(path, **options):
        opened.append(os.path.basename(os.fspath(path)))
        return real(path, **options)

    monkeypatch.setattr(safe_open, "binary", noting)
    repeated = hinge("n {n}.csv")
    for one in repeated["parts"].values():
        one["repeat"] = {"count": 2}
    repeated["parts"]["hinge"]["b"] = "panel {n}"
    repeated["parts"]["harness"]["joint"] = "hinge {n}"
    loop = hinge()
    loop["parts"]["harness"] = {"kind": "resistance", "type": "harness", "joint": "hinge", "loop": "t.csv"}
    for content in (hinge(), repeated, loop, PANEL):
        opened.clear()
        case = cases.load(content)
        cases.system("structure").system(case).assemble() if content is not loop else None
        assert set(opened)
        assert set(opened) <= {os.path.basename(name) for name in cases.files_of(content)}


def test_files_beside_a_model_of_nastran_count():
    content = {"system": "structure", "parts": {"b": {"kind": "reduced-body", "file": "m.op4", "bulk": "points.bdf"}}}
    for name in ("m.op4", "m.asm", "m.pch", "points.bdf"):
        pathlib.Path(name).write_text(name)
    assert set(cases.files_of(content)) == {"m.op4", "m.asm", "m.pch", "points.bdf"}


def _digests(case: dict, **more: object) -> dict[str, str]:
    asked = {"study": "s", "case": case, "over": {"parts.panel.inertia": ["0.5 kg m^2", "1 kg m^2"]}, **more}
    return study.read({**asked, "keep": ["panel.angle.last"]}).digests


STUDIES = {
    "case": lambda: _digests(hinge()),
    "set": lambda: _digests(hinge("u.csv"), set={"parts.harness.torque": "t.csv"}),
    "axis": lambda: _digests(hinge("u.csv"), over={"parts.harness.torque": ["u.csv", "t.csv"]}),
}


@pytest.mark.parametrize("where", STUDIES)
def test_a_study_is_compared_by_its_tables(where):
    table(5.0, "u.csv")
    table(1.0)
    first = STUDIES[where]()
    assert STUDIES[where]() == first
    table(30.0)
    assert STUDIES[where]() != first


def _models(file: str = "own.npz", **more: object) -> dict[str, str]:
    case = {**PANEL, "parts": {"b": {"kind": "reduced-body", "file": file}}}
    return study.read({"study": "s", "case": case, "keep": ["b.position.x.last"], **more}).digests


def test_a_study_is_compared_by_its_models():
    model(1.0)
    asked = [
        lambda: _models(over={"parts.b.damping_ratio": [0.0, 0.1]}),
        lambda: _models("solar-panel", over={"parts.b.file": ["solar-panel", "own.npz"]}),
        lambda: _models("solar-panel", set={"parts.b.file": "own.npz"}, over={"parts.b.damping_ratio": [0.0, 0.1]}),
    ]
    first = [one() for one in asked]
    assert [one() for one in asked] == first
    model(2.0)
    for one, before in zip(asked, first, strict=True):
        assert one() != before


def test_a_kept_study_is_refused_with_the_file_that_changed():
    table(1.0)
    asked = {
        "study": "s", "case": hinge(), "over": {"parts.panel.inertia": ["0.5 kg m^2", "1 kg m^2"]},
        "keep": ["panel.angle.last"],
    }  # fmt: skip
    before = studies.sweep(asked, output="a", workers=1)["panel_angle_last"].values
    table(30.0)
    with pytest.raises(InputError, match=r"holds the study 's' with other cases and file 't\.csv'"):
        studies.sweep(asked, output="a", workers=1)
    after = studies.sweep(asked, output="b", workers=1)["panel_angle_last"].values
    assert np.all(np.abs(after - before) > 0.1)
    again = studies.sweep("a/study.yaml", output="a", workers=1)["panel_angle_last"].values  # which holds the rows
    np.testing.assert_array_equal(again, before)


def test_a_file_that_changes_while_runs_read_it_is_refused():
    model(1.0)
    asked = study.read({"study": "s", "case": PANEL, "over": {"parts.b.damping_ratio": [0.0, 0.1]}})
    evaluator = Evaluator(runs_of(asked, "."))
    model(2.0)
    with pytest.raises(InputError, match=r"the file 'own\.npz' was changed while runs read it"):
        evaluator.of([Points(asked)[0]])
    own = problem.read(dict(PANEL), vary={"parts.b.damping_ratio": "0 to 0.1"}, minimize=["b.position.x.max"])
    files = Designs(own, 1, 10, None).runs.files
    model(3.0)
    with pytest.raises(InputError, match=r"own\.npz"):
        cases.check_files(files)


def test_a_model_is_read_again_whatever_its_size_and_time():
    model(1.0)
    body, status = parts.ReducedBody(file="own.npz"), os.stat("own.npz")
    before = body.model.mass
    model(2.0)
    os.utime("own.npz", ns=(status.st_atime_ns, status.st_mtime_ns))
    np.testing.assert_allclose(body.model.mass, 2.0 * before)


def test_a_run_says_which_files_it_read():
    model(1.0)
    system = ev.System()
    system.add(parts.ReducedBody(file="own.npz", velocity=(1.0, 0.0, 0.0)), "b")
    run = system.simulate(until="0.1 s", every="0.05 s")
    assert cases.files_of_run(run) == {"own.npz": file_keys.digest("own.npz")}
    run = ev.run(PANEL)
    assert cases.files_of_run(run) == {"own.npz": file_keys.digest("own.npz")}
    model(2.0)
    with pytest.raises(InputError, match=r"the file 'own\.npz' is not the one that the run read"):
        run.ev.sensitivity("b.position.x.last", "parts.b.damping_ratio")


@pytest.mark.slow
def test_evaluations_of_a_fit_are_kept_under_the_content_of_files():
    def fitted(scale: float, folder: str, times: float = 1.0) -> float:
        table(scale)
        rows = (f"{times * k / 4},{-0.1 * (k / 4) ** 2}" for k in range(5))
        pathlib.Path("data.csv").write_text("time (s),angle (rad)\n" + "\n".join(rows))
        found = calibration.calibrate(
            hinge(), "data.csv", fit=["parts.panel.inertia"], observe=["panel.angle=angle"], folder=folder,
        )  # fmt: skip
        return float(found.values[0])

    first = fitted(1.0, "a")
    assert fitted(1.0, "a") == first
    assert fitted(30.0, "a") == fitted(30.0, "b") != first
    assert fitted(1.0, "a", times=0.5) == fitted(1.0, "c", times=0.5) != first  # the same values at other times


def test_sources_of_packages_outside_count(tmp_path, monkeypatch):
    (tmp_path / "outside_part").mkdir()
    (tmp_path / "outside_part" / "__init__.py").write_text("")
    law = tmp_path / "outside_part" / "law.py"
    law.write_text("K = 1.0\n")
    entry = importlib.metadata.EntryPoint(name="p", value="outside_part.law:K", group=registry.GROUP)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(plugins, "entry_points", lambda group: [entry] if group == registry.GROUP else [])
    before = sources.sources.__wrapped__()
    assert sources.sources.__wrapped__() == before
    law.write_text("K = 2.0\n")
    assert sources.sources.__wrapped__() != before
