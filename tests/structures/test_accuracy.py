"""Fits, designs and derivatives include, or state, the error of integration of their runs."""

from __future__ import annotations

import pathlib

import numpy as np
import pytest

import evolvent as ev
from evolvent.analysis import accuracy
from evolvent.design import calibration, optimization
from evolvent.solvers.time.implicit import plan as implicit

J, K, C, START = 2.0, 8.0, 0.2, 0.1


def hinge(**simulate: object) -> dict:
    """A panel on a hinge with a spring and a damper, from rest; the start of a fit."""
    found = {
        "panel": {"kind": "rigid-body", "mass": "1 kg", "inertia": [2.0, 2.0, 2.0],
                  "orientation": {"axis": [0, 0, 1], "angle": START}},
        "hinge": {"kind": "joint", "a": "ground", "b": "panel", "type": "revolute", "axis": [0, 0, 1],
                  "position": [0, 0, 0]},
        "spring": {"kind": "joint-spring", "joint": "hinge", "stiffness": 6.0, "damping": 0.1, "start": START},
    }  # fmt: skip
    return {"system": "structure", "parts": found, "simulate": {"until": "10 s", **simulate}}


def closed(t: np.ndarray, k: float = K, c: float = C) -> np.ndarray:
    a = c / (2.0 * J)
    w = np.sqrt(k / J - a * a)
    return START * np.exp(-a * t) * (np.cos(w * t) + a / w * np.sin(w * t))


def fitted(folder: pathlib.Path, noise: float, seed: int = 1, **simulate: object) -> calibration.Calibration:
    t = np.linspace(0.0, 10.0, 101)
    x = closed(t) + noise * np.random.default_rng(seed).standard_normal(t.size)
    path = folder / "swing.csv"
    path.write_text("time (s),angle (rad)\n" + "\n".join(f"{a:.2f},{b:.9f}" for a, b in zip(t, x, strict=True)))
    fit = ["parts.spring.stiffness", "parts.spring.damping"]
    return calibration.calibrate(hinge(**simulate), str(path), fit=fit, observe=["spring.angle=angle"])


SETTINGS = {
    "the default": {},
    "fixed steps": {"method": "generalized-alpha", "step": "50 ms"},
}


@pytest.mark.slow
@pytest.mark.parametrize("which", SETTINGS)
def test_the_truth_is_within_the_errors_of_a_fit(tmp_path, which):
    found = fitted(tmp_path, 1e-4, **SETTINGS[which])
    assert np.all(np.abs(found.values - [K, C]) < 3.0 * found.errors)
    assert np.all(found.errors < 1.3 * np.array([2.9e-4, 1.4e-4]))  # those of the closed form, fitted to such data
    assert np.all(found.integration <= 0.15 * found.errors)
    assert "finer than the case says" in found.accuracy
    assert found.accuracy in str(found)


@pytest.mark.slow
def test_data_without_noise_have_the_error_of_integration(tmp_path):
    found = fitted(tmp_path, 0.0)
    assert np.all(np.abs(found.values - [K, C]) < 2.0 * found.errors)
    assert np.all(found.errors < 1e-4)


@pytest.mark.slow
def test_derivatives_state_their_error():
    case = hinge()
    case["parts"]["spring"] |= {"stiffness": K, "damping": C}
    system = ev.load(case)
    found = system.sensitivity("spring.angle.last", "spring.stiffness").dataset
    d = 1e-5
    by = (closed(np.array([10.0]), k=K + d) - closed(np.array([10.0]), k=K - d))[0] / (2.0 * d)
    off = abs(float(found.derivative[0, 0]) - by)
    assert 0.1 * off < float(found.derivative_error[0, 0]) < 10.0 * off
    off = abs(float(found.result[0]) - closed(np.array([10.0]))[0])
    assert 0.1 * off < float(found.result_error[0]) < 10.0 * off
    assert "errors of integration" in found.attrs["integration"]
    rough = system.sensitivity("spring.angle.last", "spring.stiffness", method="energy-momentum", step=0.15).dataset
    assert "has an error of some" in rough.attrs["warning"]
    # twice as long steps gain energy
    longest = system.sensitivity("spring.angle.last", "spring.stiffness", step=0.1).dataset
    off = abs(float(longest.derivative[0, 0]) - by)
    assert 0.1 * off < float(longest.derivative_error[0, 0]) < 10.0 * off
    assert "derivative_error" not in system.sensitivity("spring.angle.last", "spring.stiffness", check=False).dataset


@pytest.mark.slow
def test_a_design_states_the_error_of_its_best():
    case = hinge(tolerance=1e-3)
    found = optimization.optimize(
        case, vary={"parts.spring.stiffness": "4 to 9"}, minimize=["spring.angle.last"], starts=1, most_runs=60
    )
    truth = closed(np.array([10.0]), k=float(found.values["parts.spring.stiffness"]), c=0.1)[0]
    own, finer = found.best.result.objective, found.finer.objective
    assert abs(finer - truth) < 0.2 * abs(own - truth)
    lines = "\n".join(found.answer().heads)
    assert "error of integration: a finer one changes the objective by" in lines


def test_levels_of_integration():
    system = ev.load(hinge())
    assembly, samples = system.assemble(), np.linspace(0.0, 1.0, 3)
    assert accuracy.settings_at(0, assembly, samples, {}) == {}
    assert accuracy.settings_at(1, assembly, samples, {"tolerance": 1e-5}) == {"tolerance": pytest.approx(1e-7)}
    own = {"method": "generalized-alpha", "step": 0.1}
    assert accuracy.settings_at(1, assembly, samples, own)["step"] == pytest.approx(0.025)
    assert accuracy.settings_at(-0.5, assembly, samples, own)["step"] == pytest.approx(0.2)
    for method, tolerance in ((implicit.NAME, 1e-2 * implicit.METHODS[implicit.NAME].tolerance), ("dopri5", 1e-10)):
        found = accuracy.settings_at(1, assembly, samples, {"method": method})
        assert found["tolerance"] == pytest.approx(tolerance)
