"""Files of the working folder that would hold up the studio: read by a process with limits of time and memory."""

from __future__ import annotations

import json
import pathlib
import threading
import time
from typing import Any

import pytest

from evolvent import cases
from evolvent_base.errors import InputError
from evolvent_studio import listing, preview, reading
from evolvent_studio.folder import Folder

pytestmark = pytest.mark.slow


def test_a_list_of_files_does_not_wait_for_slow_ones(tmp_path: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Files are listed at once as being read, and then as what they are; each is read once."""
    (tmp_path / "0.yaml").write_text("system: heliogyro\n")
    (tmp_path / "stand.yml").write_text("stand: {kind: springs}\n")
    for k in range(4):
        (tmp_path / f"slow-{k}.yaml").write_text("a: [1, 2]")
    ask, go_on, read = reading.Reader.ask, threading.Event(), []

    def asked(reader: reading.Reader, *task: Any, **given: Any) -> Any:
        if given["name"].startswith("slow"):
            go_on.wait(60.0)
        read.append(given["name"])
        return ask(reader, *task, **given)

    monkeypatch.setattr(reading.Reader, "ask", asked)
    monkeypatch.setattr(listing, "_WAIT", 0.05)
    folder = Folder(tmp_path)
    assert len(folder.yaml()) + len(folder.unreadable()) == 6
    assert {name for name, said in folder.unreadable().items() if said == "is being read"} >= {
        f"slow-{k}.yaml" for k in range(4)
    }
    assert not [name for name in read if name.startswith("slow")]
    monkeypatch.setattr(listing, "_WAIT", 60.0)
    go_on.set()
    found = folder.yaml()
    assert found["0.yaml"].keys == {"system"}
    assert found["stand.yml"].is_stand
    assert len(found) == len(read) == 6
    (tmp_path / "slow-0.yaml").write_text("[1, 2]")
    (tmp_path / "slow-1.yaml").write_text("a: [")
    assert folder.unreadable() == {"slow-0.yaml": "cannot be read", "slow-1.yaml": "cannot be read"}


def test_texts_of_forms_are_bounded(tmp_path: pathlib.Path) -> None:
    (tmp_path / "many.yaml").write_text(f"a: [{'1,' * 30_000}]")
    (tmp_path / "blanks.yaml").write_text(f'system: heliogyro\nblade: {{length: "1 m{" " * 60_000}x"}}\n')
    (tmp_path / "wrong.yaml").write_text("a: [")
    folder = Folder(tmp_path)
    with pytest.raises(InputError, match=r"many\.yaml: it holds 30002 values; the studio shows 20000 at most"):
        folder.content("many.yaml")
    with pytest.raises(InputError, match=r"wrong\.yaml, line 1"):
        folder.content("wrong.yaml")
    began = time.perf_counter()
    with pytest.raises(InputError, match=r"blade\.length"):
        cases.load("heliogyro", {"blade.length": folder.content("blanks.yaml")["blade"]["length"]})
    assert time.perf_counter() - began < 5.0


@pytest.mark.parametrize(
    ("module", "task", "given"),
    [
        ("reading", "content", {"source": f"a: [{'1,' * 190_000}]", "name": "text"}),
        # a new process loads the functions of the case first
        ("preview", "start", {"content": cases.content_of("two-booms")}),
    ],
)
def test_what_takes_too_long_or_too_much_is_ended(module: str, task: str, given: dict[str, Any]) -> None:
    """The process dies, and the next task finds another one."""
    found = reading.Reader(module)
    try:
        with pytest.raises(InputError, match=r"takes more than 0.001 s or 4 GB"):
            found.ask(task, 0.001, **given)
        if task == "content":
            assert found.ask(task, 10.0, source="{a: 1, b: [.inf, x]}", name="text") == {
                "a": 1,
                "b": [float("inf"), "x"],
            }
    finally:
        found.end()


def test_the_start_of_a_case_is_drawn_by_another_process() -> None:
    content = cases.content_of("two-booms")
    assert reading.start(content, lambda text: None) == preview.start_of(content)
    with pytest.raises(InputError, match=r"unknown key 'hubb'"):
        reading.start(content | {"hubb": 1}, lambda text: None)


def test_large_cases_are_not_assembled_before_they_run() -> None:
    boom = {"kind": "beam", "elements": 100_000}
    case = {"parts": {f"boom {k}": boom for k in range(10)} | {"tape": {"nodes": 50, "multiplicity": 4}}}
    with pytest.raises(InputError, match=r"the case has 1000200 elements and nodes; the start of at most 20000"):
        reading.check_size(case)
    reading.check_size(json.loads(json.dumps(cases.content_of("two-booms"))))
