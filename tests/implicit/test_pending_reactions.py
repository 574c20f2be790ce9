"""Reactions at the samples of an implicit run are evaluated where they are asked for, with the same bits."""

import pytest

from evolvent import cases
from evolvent.solvers.time.implicit import reactions


@pytest.mark.slow
def test_reactions_are_evaluated_where_they_are_asked_for(monkeypatch):
    plan = cases.system("structure").plan(cases.load("solar-array", {"simulate.until": "3 s"}))
    whole = plan.run(None)
    evaluated, calls = reactions.PendingReactions.evaluated, []
    monkeypatch.setattr(
        reactions.PendingReactions, "evaluated", lambda self: calls.append(self.samples.size) or evaluated(self)
    )
    seen = plan.observe(["hinge 1.angle", "panel 3.rate"])
    assert calls == []
    assert seen["hinge 1.angle"].values.tobytes() == whole["hinge 1"].angle.values.tobytes()
    assert seen["panel 3.rate"].values.tobytes() == whole["panel 3"].rate.values.tobytes()
    seen = plan.observe(["pivot 1.force"])
    assert set(calls) == {whole.time.size}
    assert seen["pivot 1.force"].values.tobytes() == whole["pivot 1"].force.values.tobytes()
