"""Files that a case or study names: the studio opens all that lie in the working folder, and none outside."""

from __future__ import annotations

import json
import os
import pathlib
import shutil
import types
from typing import Any

import pytest

from evolvent import cases
from evolvent.elements.reduced_files import SHIPPED
from evolvent.parts import registry
from evolvent_base import safe_open, schema
from evolvent_base.errors import InputError
from evolvent_base.file_keys import FileKey
from evolvent_studio import preview
from evolvent_studio.folder import Folder

pytestmark = pytest.mark.skipif(os.name == "nt", reason="links as POSIX has them")

#: A name with a blank for each ending of a file that a key may name.
NAMES = ("a b.csv", "a b.yaml", "a b.nc", "a b.npz", "a b.json", "a b.op4", "a b.bdf")


def marked(kind: type[schema.Section], key: str) -> list[FileKey]:
    try:
        place = schema.locate(kind, key)
    except InputError:  # of an entry of a list, whose number is missing
        return []
    return [mark for _, own in place.types for mark in own if isinstance(mark, FileKey)]


def keys_of_systems() -> dict[str, tuple[str, list[FileKey]]]:
    """System and annotations of the keys of all cases that name files, those of parts as "parts.x.KEY"."""
    found = {}
    for system in cases.systems():
        kind = cases.system(system).Case
        for key in schema.keys(kind):
            marks = marked(kind, key)
            if marks:
                found[f"{system}:{key}"] = (system, marks)
    for name, part in registry.kinds().items():
        for key in schema.keys(part):
            if marks := marked(part, key):
                found[f"structure:parts.{name}.{key}"] = ("structure", marks)
    return found


KEYS = keys_of_systems()


def case_with(key: str, value: Any) -> dict[str, Any]:
    """A case of that system whose key has a value."""
    system, _, dotted = key.partition(":")
    content: dict[str, Any] = {"system": system}
    here, names = content, dotted.split(".")
    for name in names[:-1]:
        here = here.setdefault(name, {})
        if len(names) > 2 and name == names[1] and names[0] == "parts":
            here["kind"] = name
    here[names[-1]] = value
    return content


def value_in(content: Any, key: str) -> Any:
    for name in key.partition(":")[2].split("."):
        content = content[name]
    return content


def names_for(marks: list[FileKey]) -> list[str]:
    return [name for name in NAMES if any(one.may_be(name) for one in marks)]


@pytest.fixture
def root(tmp_path: pathlib.Path) -> pathlib.Path:
    (tmp_path / "work" / "sub").mkdir(parents=True)
    (tmp_path / "out side").mkdir()
    return tmp_path / "work"


def test_the_schema_marks_keys_of_all_kinds() -> None:
    parts = {f"structure:parts.{key}" for key in ("resistance.torque", "reduced-body.file", "reduced-body.bulk")}
    assert parts | {"structure:margin.factors", "wrapped-rib:start"} <= set(KEYS)


@pytest.mark.parametrize("kind", sorted(registry.kinds()))
def test_what_reads_a_file_is_marked(kind: str, monkeypatch, tmp_path) -> None:
    """Each key of each kind of part is given the name of a file; those that open it are marked."""
    opened: list[str] = []

    def binary(path: Any, **_: Any) -> Any:
        opened.append(os.fspath(path))
        raise InputError("not here")

    monkeypatch.setattr(safe_open, "binary", binary)
    part = registry.kinds()[kind]
    for key in part.model_fields:
        for name in NAMES:
            opened.clear()
            with pytest.raises((InputError, ValueError)):
                part.__pydantic_validator__.validate_python({"kind": kind, key: name, "no such key": 1})
            assert not opened or f"structure:parts.{kind}.{key}" in KEYS, f"{key} opens {opened}"


@pytest.mark.parametrize("key", sorted(KEYS))
def test_every_key_that_names_a_file_passes_the_gate(root: pathlib.Path, key: str) -> None:
    outside = root.parent / "out side"
    for name in names_for(KEYS[key][1]):
        (root / name).write_text("x")
        (outside / name).write_text("x")
        (root / f"link {name}").symlink_to(outside / name)
        (root / "linked").unlink(missing_ok=True)
        (root / "linked").symlink_to(outside)
        for given in (name, f"sub/../{name}", str(root / name)):
            assert value_in(Folder(root).placed(case_with(key, given)), key) == str(root / name)
        others = (str(outside / name), f"../out side/{name}", f"linked/{name}", f"link {name}", f" {outside / name}")
        for other in others:
            for content in (
                case_with(key, other),
                {"case": case_with(key, name), "set": {key.partition(":")[2]: other}},
                {"case": case_with(key, name), "over": {key.partition(":")[2]: [name, other]}},
                {"case": case_with(key, name), "stages": [{"name": "s", "set": {key.partition(":")[2]: other}}]},
            ):
                with pytest.raises(InputError, match="outside the working folder"):
                    Folder(root).placed(content)
    studied = {"case": case_with(key, name), "over": {key.partition(":")[2]: [name]}}
    assert Folder(root).placed(studied)["over"] == {key.partition(":")[2]: [str(root / name)]}


def hinged(**more: Any) -> dict[str, Any]:
    return {
        "system": "structure",
        "parts": {
            "panel": {"kind": "rigid-body", "motion": "spin", "inertia": 1},
            "hinge": {"kind": "joint-spring", "a": "ground", "b": "panel", "start": 1, "stiffness": 1, "rest": 0},
            **more,
        },
        "simulate": {"until": 1},
    }


@pytest.mark.slow
def test_tables_and_models_of_the_folder_are_drawn_from_anywhere(root, monkeypatch, tmp_path) -> None:
    """Names count from the folder of the case on, else from the working folder on."""
    (root / "sub" / "own table.csv").write_text("angle (deg),torque (N m)\n-180,-1\n180,2\n")
    shutil.copy(SHIPPED / "solar-panel.npz", root / "own model.npz")
    content = hinged(
        w={"kind": "resistance", "type": "harness", "joint": "hinge", "torque": "own table.csv"},
        m={"kind": "reduced-body", "file": "own model.npz"},
        s={"kind": "reduced-body", "file": "solar-panel", "position": [0, 0, 9]},
    )
    placed = Folder(root).placed(content, "sub/case.yaml")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv(safe_open.ONLY_BELOW, str(root))
    assert len(preview.start_of(placed)) > 1000
    (root / "sub" / "case.yaml").write_text(json.dumps(content))
    over = {"parts.panel.inertia": [1.0, 2.0]}
    (root / "study.yaml").write_text(json.dumps({"case": "sub/case.yaml", "over": over}))
    assert Folder(root).study("study.yaml")["case"]["parts"]["w"]["torque"] == str(root / "sub" / "own table.csv")


def test_the_processes_of_the_studio_open_no_file_outside(root, monkeypatch) -> None:
    """What no look at the case finds: the number of a repeated part makes the name of a link."""
    (root.parent / "out side" / "secret.csv").write_text("angle (deg),torque (N m)\n0,0\n1,1\n")
    (root / "t1.csv").symlink_to(root.parent / "out side" / "secret.csv")
    monkeypatch.setenv(safe_open.ONLY_BELOW, str(root))
    harness = {"kind": "resistance", "type": "harness", "joint": "hinge", "torque": "t{n}.csv", "repeat": {"count": 2}}
    with pytest.raises(InputError, match=r"t1.csv': it is outside the folder"):
        cases.load(Folder(root).placed(hinged(w=harness)))
    (root / "t.txt").write_text("x")
    assert safe_open.content(root / "t.txt") == b"x"
    assert safe_open.content(SHIPPED / "solar-panel.npz")


def test_the_server_sets_the_folder_for_itself_and_its_processes(root, monkeypatch, tmp_path) -> None:
    server = pytest.importorskip("evolvent_studio.server", reason="the studio needs nicegui (extra studio)")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv(safe_open.ONLY_BELOW, "")
    seen, at_end = [], []
    taken = {"add_middleware": lambda *_, **keys: None, "on_startup": lambda _: None, "on_shutdown": at_end.append}
    monkeypatch.setattr(server, "app", types.SimpleNamespace(**taken))
    for module in (server.page, server.routes):
        monkeypatch.setattr(module, "install", lambda *_: None)
    monkeypatch.setattr(server.ui, "run", lambda **_: seen.append(os.environ[safe_open.ONLY_BELOW]))
    server.serve(str(root), host="127.0.0.1", port=0, token=None, browser=False)
    for stop in at_end:
        stop()
    assert seen == [str(root)]
