"""Times between the samples at which derived quantities get a run as well."""

import numpy as np

import evolvent
from evolvent import analysis, cases


def test_times_between_samples_are_told_from_samples():
    samples = np.array([0.0, 1.0, 2.0, 3.0])
    times, kept = analysis.with_times(samples, np.array([-1.0, 0.5, 1.0, 1.0 + 1e-12, 2.5, 2.7, 3.0, 4.0]))
    np.testing.assert_array_equal(times, [0.0, 0.5, 1.0, 2.0, 2.5, 2.7, 3.0])
    np.testing.assert_array_equal(times[kept], samples)
    times, kept = analysis.with_times(samples, np.zeros(0))
    assert kept.all()


def test_a_run_with_times_between_keeps_its_samples(monkeypatch):
    """A boom on a hub: the largest rate over all times is found; the samples are those of a run without."""
    system = cases.system("structure")
    wanted = evolvent.run("boom-slew", {"simulate.until": "1 s", "simulate.every": "0.25 s"})
    between = np.linspace(0.0, 1.0, 101)
    monkeypatch.setattr(type(system), "between", lambda self, case: between)

    def derived(self, case, solution):
        seen = np.array([solution.t.size])
        return {"seen": (("count",), seen, "1", "samples"), "at": (("time",), solution.t, "s", "time of each sample")}

    monkeypatch.setattr(type(system), "derived", derived)
    run = evolvent.run("boom-slew", {"simulate.until": "1 s", "simulate.every": "0.25 s"})
    assert run["seen"].values == [101]
    np.testing.assert_array_equal(run["at"].values, run["time"].values)
    np.testing.assert_array_equal(run["time"].values, wanted["time"].values)
    assert run["hub"]["rate"].shape == wanted["hub"]["rate"].shape
