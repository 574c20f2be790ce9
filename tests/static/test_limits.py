"""Results without a run say what their equilibrium is beyond: modes, linear models, reduced bodies, steppers."""

from __future__ import annotations

import json

import numpy as np
import pytest

from evolvent import System, parts
from evolvent.elements import Circle
from evolvent.elements.reduced_files import read_model, write_model
from evolvent.elements.reduced_models import ReducedModel

SOFT = {"young_modulus": 1e6, "poisson_ratio": 0.3, "density": 1000.0}


def hanging(part: parts.Beam | parts.Rod, load: float) -> System:
    system = System(gravity=(0.0, 0.0, -10.0))
    system.add(part, "wire")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="wire.root", type="clamp"), "clamp")
    system.add(parts.Point(mass=load, at="wire.tip"), "load")
    return system


@pytest.mark.slow
def test_a_rod_beyond_its_tension_is_named_by_every_result(tmp_path):
    """12 E I/l^2 = 1.6 N of an element: at 1 N nothing is said, at 100 N everything says it."""
    own = {"length": 1.0, "direction": (0.0, 0.0, -1.0), "section": Circle(radius=1e-3), "material": "steel"}
    limit = 12.0 * 2.1e11 * np.pi * 1e-12 / 4.0 / 0.25**2
    below = hanging(parts.Rod(**own, elements=4), 0.05 * limit)
    assert below.modes(count=2).warning == ""
    system = hanging(parts.Rod(**own, elements=4), 0.2 * limit)
    modes = system.modes(count=2)
    for text in (modes.warning, str(modes), modes._repr_html_(), modes.to_dataset().attrs["warning"]):
        assert "above 12 E I/L^2" in text
    model = system.linearize(["load.force.x"], ["load.displacement.x"], modes=2)
    assert "above 12 E I/L^2" in model.warning
    assert model.warning in repr(model)
    assert "above 12 E I/L^2" in system.equilibrium().attrs["warning"]


@pytest.mark.slow
def test_large_strain_under_greens_strain_is_named():
    own = {"length": 1.0, "direction": (0.0, 0.0, -1.0), "section": Circle(radius=1e-2), "material": SOFT}
    area = np.pi * 1e-4
    for share, said in ((0.02, False), (0.15, True)):
        load = share * 1e6 * area / 10.0
        system = hanging(parts.Beam(**own, elements=4, formulation="cable"), load)
        assert ("Green's strain" in system.modes(count=2).warning) == said
    system = hanging(parts.Beam(**own, elements=4, formulation="cable_stretch"), load)
    assert system.modes(count=2).warning == ""


@pytest.mark.parametrize("ending", ["json", "npz"])
def test_files_of_reduced_models_keep_the_warning(tmp_path, ending):
    model = ReducedModel(np.zeros((6, 6)), np.eye(6), np.zeros((1, 3)), ("root",), np.zeros((0, 6)), warning="beyond")
    path = str(tmp_path / f"model.{ending}")
    write_model(path, model)
    assert read_model(path).warning == "beyond"
    if ending == "json":
        assert json.loads((tmp_path / "model.json").read_text())["warning"] == "beyond"
