"""Answers of a reflector against other solutions, and what is refused of measured surfaces."""

from __future__ import annotations

import json
import pathlib
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from evolvent import System, parts
from evolvent.analysis.reflector import NetInSystem
from evolvent.nets import error
from evolvent_base.errors import InputError

Array = np.ndarray
FOCAL = 7.8


def system(**keys: Any) -> System:
    """A net of two rings on a rim that stands still, with anchors; keys in place of its own."""
    given: dict[str, Any] = {
        "surface": {"paraboloid": {"focal_length": FOCAL, "diameter": 10.0}}, "topology": {"rings": {"rings": 2}},
        "force_density": 10.0, "stiffness": 2e4, "node_mass": 0.01,
        "ties": {"anchors": {"length": 0.5, "stiffness": 5e3}},
    }  # fmt: skip
    found = System()
    found.add(parts.Net(**(given | keys)), "net")
    return found


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("node,x,y,z\n", "no rows below a head"),
        ("node;x;y;z\n0;0;0;0\n", "needs columns node, x, y and z"),
        ("node,x,y,z\n0,0,0,nan\n", "place of node 0 is not finite"),
        ("node,x,y,z\n0,0,0,0\n0,0,0,0.001\n", "a node twice"),
        ("node,x,y,z\n19,0,0,0\n", "nodes must be of 0 to 18"),
        ("node,x,y,z\n0,0,0,12.5\n", "node 0 is 12.5 m from its place"),
    ],
)
def test_measured_surfaces_that_are_none_are_refused(text: str, sentence: str, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "measured.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        system().reflector(measured=str(path))


def test_measured_surfaces_as_programs_write_them(tmp_path: pathlib.Path) -> None:
    """With a mark of the encoding, and blanks after commas."""
    path = tmp_path / "measured.csv"
    path.write_text("\ufeffnode, x, y, z\n0, 0, 0, 0.001\n", encoding="utf-8")
    found = system().reflector(measured=str(path)).adjusted
    assert found is not None
    assert found.before == pytest.approx(1e-3)


def test_surfaces_that_are_no_reflector_are_named(tmp_path: pathlib.Path) -> None:
    """A net whose cords have gone slack by heat, a flat one, which a paraboloid of no depth fits, a folded one."""
    warm = system(thermal_expansion=1e-3).reflector(temperature=200.0)
    assert any("at +200 K" in one and "cords are slack" in one for one in warm.fails)
    flat = system(ties=None).reflector()
    assert any("times the heights of the wanted one" in one for one in flat.fails)
    path = tmp_path / "net.json"
    facets = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]
    nodes, rim = [[0, 0], [3, 0], [0, 3], [-3, 0], [0, -3]], [1, 2, 3, 4]
    path.write_text(json.dumps({"nodes": nodes, "cords": [[0, 1], [0, 2]], "rim": rim, "facets": facets}))
    folded = system(topology={"file": {"file": str(path)}}, ties=None)
    assert any("1 of 4 facets are turned over" in one for one in folded.reflector().fails)
    with pytest.raises(InputError, match="a strain of -2; it must be above -1"):
        system(thermal_expansion=1e-3).reflector(temperature=-2000.0)


def test_heat_is_that_of_longer_cords(tmp_path: pathlib.Path) -> None:
    """The net at another temperature is one whose cords are cut shorter by the strain, to a stiffness of E A."""
    found = system(thermal_expansion=1e-5).reflector(temperature=-50.0)
    path = tmp_path / "cut.json"
    path.write_text(json.dumps({"lengths": (found.cut_lengths * (1.0 - 5e-4)).tolist()}))
    again = system(cut=str(path)).reflector()
    assert found.warm is not None
    assert found.warm.fit.rms == pytest.approx(again.error.fit.rms, rel=1e-10)
    assert found.warm.half_path == pytest.approx(again.error.half_path, rel=1e-10)


def test_bound_of_errors_of_lengths_against_draws() -> None:
    """Quantiles of nets that were cut with errors and brought into equilibrium, against that of the linear response."""
    made, sigma = system(), 5e-3
    own, rng = NetInSystem(made.assemble(), "net"), np.random.default_rng(7)
    state, found = own.formed(), []
    kept = state.natural
    for _ in range(24):
        own.cut(kept + sigma * rng.standard_normal(len(kept)))
        found.append(own.error(own.equilibrium(state.y)).fit.rms)
    bound = made.reflector(length_error=sigma).tolerance.bound
    assert np.sort(found)[[20, 23]] == pytest.approx(bound, rel=0.05)


@pytest.mark.parametrize("offset", [0.0, 6.0])
def test_best_fit_against_another_solution(offset: float) -> None:
    """The fit of a net in six parameters of other rotations and of the focal length, by another method of scipy."""
    surface = {"paraboloid": {"focal_length": FOCAL, "diameter": 10.0, "offset": offset}}
    found = system(surface=surface).reflector()
    p, w = error.quadrature(found.x, found.topology.facets)
    weights = np.sqrt(w / w.sum()) / (1.0 + (p[:, 0] ** 2 + p[:, 1] ** 2) / (4.0 * FOCAL**2))

    def left(q: Array) -> Array:
        own = (p - q[:3]) @ Rotation.from_euler("XY", q[3:5]).as_matrix()
        square = own[:, 0] ** 2 + own[:, 1] ** 2
        return np.asarray(weights * (own[:, 2] - square / (4.0 * q[5] * FOCAL)))

    other = least_squares(left, [0.0, 0.0, 0.0, 0.0, 0.0, 1.0], method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert found.error.fit.rms == pytest.approx(float(np.linalg.norm(other.fun)), rel=1e-9)
    assert 1.0 / found.error.fit.scale == pytest.approx(other.x[5], rel=1e-6)
