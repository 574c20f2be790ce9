"""The command `evolvent figure`: the list, refusals, tables and pictures whose failed runs are rows."""

import math

import numpy as np
import pytest
from PIL import Image

import evolvent
from evolvent import results
from evolvent_base.errors import InputError
from evolvent_base.figures import Figure, Line, Panel
from evolvent_papers import papers
from evolvent_papers.papers import rib, winding
from evolvent_papers.papers.winding import ALPHA, ENERGY, Model, Trial


def test_list_names_every_entry(call):
    code, out, err = call("figure", "list")
    assert (code, err) == (0, "")
    assert [line.partition("  ")[0] for line in out.splitlines()] == list(papers.ENTRIES)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["rib-table-2"], "no table or figure is called 'rib-table-2'; did you mean 'rib-table-1'?"),
        (["rib-table-1", "-o", "t.png"], "cannot write 't.png': the file of a table ends with .md"),
        (["rib-figure-10", "-o", "f.md"], "cannot write 'f.md': the file of a figure ends with .png or .svg or .pdf"),
        (["rib-table-1", "-o", "no/t.md"], "cannot write 'no/t.md': there is no folder 'no'"),
    ],
)
def test_refusals(call, words, sentence):
    code, out, err = call("figure", *words)
    assert (code, out) == (2, "")
    assert sentence in err


def test_a_table_is_printed_and_kept(call, monkeypatch, tmp_path):
    made = papers.Made(text="| a |\n|---|\n| 1 |")
    monkeypatch.setattr(rib, "table_1", lambda options: made if options.quick else None)
    code, out, _ = call("figure", "rib-table-1", "--quick", "-o", "t.md")
    assert (code, out) == (0, made.text + "\n")
    assert (tmp_path / "t.md").read_text() == out


def test_a_figure_of_an_interrupted_computation_is_kept(call, monkeypatch, tmp_path):
    x = np.linspace(0.0, 1.0, 5)
    figure = Figure(name="f", title="f", panels=[Panel(x_label="x", y_label="y", lines=[Line(x=x, y=x)])])
    monkeypatch.setattr(rib, "figure_10", lambda options: papers.Made(text="", figure=figure, complete=False))
    code, _, err = call("figure", "rib-figure-10")
    assert code == 130
    assert "interrupted; what was computed is kept" in err
    with Image.open(tmp_path / "rib-figure-10.png") as picture:
        assert picture.width > 500


# ---------------------------------------------------------------------------------------------- runs


@pytest.fixture(scope="module")
def short() -> Model:
    return Model("wrapped-rib", 2.0)


def test_runs_over_the_step_come_to_one_path(short):
    reference = short.run(Trial(ENERGY, step=0.005))
    assert reference.error(reference, 2.0) == 0.0
    for trial in (Trial(ENERGY, step=0.1), Trial(ALPHA, step=0.05), Trial(ALPHA, tolerance=1e-4)):
        found = short.run(trial)
        assert found.outcome == "finished"
        assert found.error(reference, 2.0) < 1e-3
        assert found.gain < 1e-3
        assert found.mean_step == pytest.approx(trial.step, rel=1e-9) if trial.step else math.isnan(found.step)


def test_an_explicit_run_takes_its_share_of_the_limit_and_is_scaled(short):
    reference = short.run(Trial(ENERGY, step=0.005))
    found = short.run(Trial("rk4", share=0.5))
    limit = short.run(Trial("rk4", share=1.0, stop=0.1))
    assert found.step == pytest.approx(0.5 * limit.step)
    assert found.error(reference, 2.0) < 1e-3  # the penalty of its hinge
    assert limit.outcome == "run to 0.1 s, CPU time scaled"
    assert math.isnan(limit.error(reference, 2.0))


def test_a_failed_run_is_a_row_and_the_others_follow():
    """The paper's contact law has no solution at the first touch, at 20.5 s."""
    model = Model("wrapped-rib-paper", 22.0)
    trials = [(model, Trial(ENERGY, step=0.1)), (model, Trial(ALPHA, step=0.5)), (model, Trial(ENERGY, step=0.5))]
    heard: list[str] = []
    found = [one for _, one in winding.run_all(trials, heard.append)]
    assert [one.status for one in found] == ["success", "failed", "success"]
    assert found[1].outcome == "failed at 20.5 s"
    assert math.isnan(found[1].error(found[0], 22.0))
    assert len(heard) == 3
    assert heard[1].startswith("run 2 of 3: wrapped-rib-paper, generalized-alpha, step 0.5 s; about ")
    table = rib._table(found).splitlines()
    assert len(table) == 5
    assert {line.count("|") for line in table} == {len(rib.TABLE) + 1}


def test_the_papers_case_fails_at_the_first_touch_and_keeps_its_run(call, tmp_path):
    code, _, err = call("run", "wrapped-rib-paper", "--no-figures", "--quiet", "-o", "run.nc")
    assert code == 1
    assert "under the law paper the force jumps by c delta' where 'contact-1' is touched" in err
    kept = results.open(tmp_path / "run.nc")
    assert (kept.attrs["status"], float(kept["time"][-1])) == ("failed", 20.5)


def test_the_papers_mesh_does_not_wind_with_its_torque():
    """By steps of 0.5 s to the end: 1.1 turns in place of 3.18, and a single contact point on the hub."""
    changes = {"solver.method": ENERGY, "contact.law": "hunt-crossley"}
    found = evolvent.run("wrapped-rib-paper", changes)
    assert found.attrs["status"] == "success"
    turns = found["wrap_angle"].values[:, 0] / (2.0 * math.pi)
    assert turns[-1] == pytest.approx(1.08, abs=0.02)
    assert found["contact-1"]["points"].values[-1] == 1
    climb = found["energy_defect"].values - np.minimum.accumulate(found["energy_defect"].values)
    assert climb.max() < 1e-4 * found["work_loads"].values.max()


def test_an_interrupted_run_ends_the_others(short, monkeypatch):
    reference = short.run(Trial(ENERGY, step=0.5))
    stopped = winding.dataclasses.replace(reference, status="interrupted")
    monkeypatch.setattr(Model, "run", lambda *_: stopped)
    assert len(list(winding.run_all([(short, Trial(ENERGY, step=0.5))] * 3, papers.silent))) == 1


def test_an_end_while_functions_are_compiled_keeps_the_runs_before(short, monkeypatch):
    def run(self, trial):
        if trial.method == ALPHA:
            raise KeyboardInterrupt
        return reference

    reference = short.run(Trial(ENERGY, step=0.5))
    monkeypatch.setattr(Model, "run", run)
    trials = [(short, Trial(ENERGY, step=0.5)), (short, Trial(ALPHA, step=0.5)), (short, Trial(ENERGY, step=0.2))]
    assert len(list(winding.run_all(trials, papers.silent))) == 1
    with pytest.raises(KeyboardInterrupt):
        list(winding.run_all(trials[1:], papers.silent))


def test_quick_runs_are_some_of_all():
    assert len(rib._of_cable(quick=True)) < len(rib._of_cable(quick=False))
    assert len(rib._of_chain(quick=True)) < len(rib._of_chain(quick=False))
    assert len(rib._of_paper(quick=True)) < len(rib._of_paper(quick=False))
    for quick in (True, False):  # every kind of run is asked for the paper's step
        every = rib._of_cable(quick=quick), rib._of_chain(quick=quick), rib._of_paper(quick=quick)
        assert all(any(trial.step == 0.5 for trial in trials) for trials in every)


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (0.123, "0.12"), (9.96, "10"), (123.0, "120"), (7.4, "7.4"), (math.nan, "-")]
)
def test_numbers_have_two_digits(value, text):
    assert winding.written(value) == text
    assert winding.written(1e-5, least=0.01) == "< 0.01"


def test_an_unknown_name_is_refused():
    with pytest.raises(InputError, match="no table or figure is called 'x'; "):
        papers.entry("x")
