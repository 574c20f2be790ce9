"""The draft of the paper: numbers are those of the comparison and the documentation, references are complete."""

import json
import pathlib
import re

from evolvent_papers.papers import ledger

ROOT = pathlib.Path(__file__).parents[2]
PAPER = (ROOT / "paper" / "paper.md").read_text("utf-8")
TEXT = " ".join(PAPER.split())
WORKS = json.loads((ROOT / "docs" / "comparison.json").read_text("utf-8"))["works"]
PAGE = (ROOT / "docs" / "comparison.md").read_text("utf-8")
WORK = {"falling cable": 0, "lumped masses": 1, "body on springs": 2}


def measured(work: int, program: str, label: str, step: float) -> dict:
    """The run of a program at a step."""
    (row,) = (r for r in WORKS[work]["rows"] if r["program"] == program.lower() and r["label"].startswith(label))
    (run,) = (r for r in row["runs"] if r["step"] == step)
    return run


def median_us(run: dict) -> float:
    """Time of a step, microseconds."""
    return 1e6 * run["median"]


def in_all(program: str, label: str, step: str) -> float:
    """Time of a run with construction and checks of the model, ms, from the last table of the page that has it."""
    found = re.findall(rf"^\| {program} \| {re.escape(label)} \| {step} \| [^|]+ \| ([\d.e+]+) \|", PAGE, re.MULTILINE)
    return float(found[-1])


LABELS = {
    ("falling cable", "evolvent"): "cable_stretch, generalized-alpha",
    ("falling cable", "Exudyn"): "ANCFCable",
    ("lumped masses", "evolvent"): "points and springs, RK4",
    ("lumped masses", "Exudyn"): "mass points",
    ("lumped masses", "MoorDyn"): "line",
    ("lumped masses", "MuJoCo"): "points and tendons, RK4",
    ("body on springs", "evolvent"): "RK4",
    ("body on springs", "Exudyn"): "Lie group",
    ("body on springs", "MuJoCo"): "RK4",
}


def test_the_table_is_that_of_the_comparison():
    rows = re.findall(r"^\| (\w[\w ]+?) \| (\w+), .*? \| ([\d.]+) \| ([\d.]+) \| ([\d.e-]+) \|$", PAPER, re.MULTILINE)
    assert {(work, program) for work, program, *_ in rows} == set(LABELS)
    for work, program, step, time, error in rows:
        run = measured(WORK[work], program, LABELS[work, program], float(step))
        assert f"{median_us(run):.3g}" == f"{float(time):.3g}"
        assert f"{run['error']:.2g}" == f"{float(error):.2g}"


def test_ratios_are_those_of_the_comparison():
    def ratio(work: str, program: str, step: float) -> str:
        ours = median_us(measured(WORK[work], "evolvent", LABELS[work, "evolvent"], step))
        return f"{median_us(measured(WORK[work], program, LABELS[work, program], step)) / ours:.2g}"

    assert f"takes 1/{ratio('falling cable', 'Exudyn', 1e-3)} of the time. For a line" in TEXT
    line = [ratio("lumped masses", program, 1e-3) for program in ("Exudyn", "MoorDyn", "MuJoCo")]
    assert "the ratio is {} to Exudyn, {} to MoorDyn and {} to MuJoCo".format(*line) in TEXT
    assert f"a step of MuJoCo takes {ratio('body on springs', 'MuJoCo', 0.01)} times as long as ours" in TEXT
    shorter = in_all("evolvent", "RK4", "0.01") / in_all("MuJoCo", "RK4", "0.01")
    assert f"its short run takes 1/{shorter:.2g} of our time" in TEXT
    ours, theirs = (in_all(*of, "0.001") for of in (
        ("evolvent", "simulate_many, RK4, 2 threads"), ("MuJoCo", "rollout, RK4, 2 threads")
    ))  # fmt: skip
    assert f"100 variants of it by two threads take {theirs / ours:.2g} times our time" in TEXT
    rod = measured(0, "PyElastica", "Cosserat", 5e-5)
    cable = measured(0, "evolvent", "cable_stretch, RK4", 5e-5)
    assert f"takes {median_us(rod) / median_us(cable):.2g} times as long as one of our explicit cable" in TEXT
    assert f"an error of {1e3 * rod['error']:.2g} mm against {1e3 * cable['error']:.2g} mm" in TEXT


def test_steps_that_are_too_large():
    rows = re.findall(r"^\| (\w+) \| [^|]+ \| [\d.]+ \| ([^|]*) \|$", PAGE, flags=re.MULTILINE)
    ours = [did for program, did in rows if program == "evolvent"]
    assert len(ours) >= 9
    assert all(did.startswith(("refused", "stopped")) for did in ours)
    for program in ("Exudyn", "MuJoCo", "PyElastica"):
        assert any("wrong by" in did for name, did in rows if name == program)
    assert any("0.0253 m" in did for name, did in rows if name == "Exudyn")


def test_the_flight_is_that_of_the_documentation():
    page = " ".join((ROOT / "docs" / "systems" / "wire-booms.md").read_text("utf-8").split())
    for number in ("0.0077 rpm", "0.0148 rpm", "23 logged"):
        assert number in page
        assert number in TEXT


def test_more_than_a_hundred_statements():
    assert sum(one.source != "own" for one in ledger.every()) > 100


def test_every_reference_is_cited_and_complete():
    bibliography = (ROOT / "paper" / "paper.bib").read_text("utf-8")
    entries = dict(re.findall(r"^@\w+\{(\w+),(.*?)^\}", bibliography, flags=re.MULTILINE | re.DOTALL))
    assert set(re.findall(r"@(\w+)", PAPER.split("---", 2)[2])) == set(entries)
    for key, entry in entries.items():
        assert re.search(r"year\s+= \{\d{4}\}", entry), key
        assert re.search(r"doi\s+=|number\s+= \{JCGM|note\s+=", entry), key


def test_the_paper_is_short():
    body = PAPER.split("---", 2)[2].split("| work |")[0]
    assert 700 < len(body.split()) < 1000
