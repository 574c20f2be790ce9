"""Best fits of coarse, flat and small nets: unique, as other solutions find them, and what they do not determine."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from evolvent import System, parts
from evolvent.nets import error, form
from evolvent.nets.surface import FormulaSurface, Paraboloid, Surface
from evolvent.nets.topology import Gores

Array = np.ndarray
DISH = Paraboloid(focal_length=2.4, diameter=3.4)
PLANE = FormulaSurface(expression="0*x", diameter=3.4)
TROUGH = FormulaSurface(expression="0.1*x**2", diameter=3.4)


def coarse(ribs: int, stations: int = 2) -> tuple[Array, Array]:
    """Nodes and facets of a net between ribs on the dish, without ties: hollow along the gores."""
    topology = Gores(ribs=ribs, stations=stations, across=2, inner_radius=0.75).topology("net", DISH)
    rim = np.column_stack([topology.plan[topology.rim], DISH.height(*topology.plan[topology.rim].T)])
    return form.axial_form(topology, rim, np.ones(len(topology.cords)), form.Pull(None, 0.0))[0], topology.facets


def fits(x: Array, facets: Array, surface: Surface) -> error.Fit:
    """The best fit of facets."""
    return error.best_fit(*error.quadrature(x, facets), surface)


@pytest.mark.parametrize("ribs", [3, 4, 6])
@pytest.mark.parametrize("moved", [0.0, 0.03])
def test_coarse_nets_from_several_starts(ribs: int, moved: float) -> None:
    """Minimizations by another method, in other rotations and the focal length, end in the same fit from all starts."""
    x, facets = coarse(ribs)
    rng = np.random.default_rng(5)
    x[:, 2] += moved * rng.standard_normal(len(x))
    found, (p, w) = fits(x, facets, DISH), error.quadrature(x, facets)
    weights = np.sqrt(w / w.sum()) / (1.0 + (p[:, 0] ** 2 + p[:, 1] ** 2) / (4.0 * DISH.focal_length**2))

    def left(q: Array) -> Array:
        own = (p - q[:3]) @ Rotation.from_euler("XY", q[3:5]).as_matrix()
        return np.asarray(weights * (own[:, 2] - q[5] * (own[:, 0] ** 2 + own[:, 1] ** 2)))

    for start in ([0.0] * 6, [0.1, 0.1, 0.0, 0.1, -0.1, 0.05], [-0.3, 0.2, 0.1, 0.0, 0.1, 0.2]):
        other = least_squares(left, start, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
        assert found.rms == pytest.approx(float(np.linalg.norm(other.fun)), rel=1e-9)
        assert found.scale == pytest.approx(4.0 * DISH.focal_length * other.x[5], rel=1e-6)
    assert found.undetermined == ()
    assert 0.6 < found.scale < 1.1
    if moved == 0.0:  # by symmetry
        np.testing.assert_allclose([*found.shift[:2], *found.turn], 0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("slope", "surface", "scale", "names"),
    [
        (0.0, DISH, 0.0, ("shift along x", "shift along y")),
        (0.1, DISH, 0.0, ("shift along x", "shift along y", "shift along z")),
        (0.1, PLANE, 1.0, ("shift along x", "shift along y", "shift along z", "scale of heights")),
        (0.0, TROUGH, 0.0, ("shift along x", "shift along y")),
    ],
)
def test_flat_nets(slope: float, surface: Surface, scale: float, names: tuple[str, ...]) -> None:
    """A plane is fitted without an error by a surface of no depth, which may be anywhere in it."""
    x, facets = coarse(3)
    x[:, 2] = 0.1 + slope * x[:, 0]
    found = fits(x, facets, surface)
    assert found.rms < 1e-10
    assert found.scale == pytest.approx(scale, abs=1e-9)
    assert found.undetermined == names


def test_what_a_surface_does_not_determine() -> None:
    """A trough may be shifted along itself; a plane that is wanted, anywhere in its plane, and has no heights."""
    x, facets = coarse(4)
    x[:, 2] = TROUGH.height(x[:, 0], x[:, 1])
    assert fits(x, facets, TROUGH).undetermined == ("shift along y",)
    assert fits(x, facets, PLANE).undetermined == ("shift along x", "shift along y", "scale of heights")


def test_few_points() -> None:
    """Three points say nothing of six parameters; three that leave no error are found without one."""
    x, _ = coarse(3)
    found = error.best_fit(x[[0, 8, 14]], np.ones(3), DISH)
    assert found.rms < 1e-9
    assert found.undetermined == error.PARAMETERS


def test_flat_net_is_named() -> None:
    """A net whose surface lacks depth has a warning with the parameters that say nothing, and fails by its scale."""
    made = System()
    net = parts.Net(
        surface=DISH, topology={"rings": {"rings": 2}}, force_density=10.0, stiffness=2e4, node_mass=0.01
    )  # fmt: skip
    made.add(net, "net")
    found = made.reflector()
    assert any("times the heights of the wanted one" in one for one in found.fails)
    (sentence,) = found.unknown
    assert "does not determine shift along x, shift along y of its best fit" in sentence
    assert sentence in str(found)
