"""Forms of nets, errors of their surfaces and sensitivities: closed forms, differences, independent solutions."""

from __future__ import annotations

import json
import pathlib
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from book import Book
from evolvent import System, parts
from evolvent.analysis.reflector import NetInSystem, mean_square_slope
from evolvent.nets import error, form
from evolvent.nets.surface import FormulaSurface, Paraboloid
from evolvent.nets.topology import Gores, Rings, Topology
from evolvent_base.errors import InputError

Array = np.ndarray
CHAPTER = "Threads, reels, tethers"
FOCAL, SIDE = 7.8, 1.0


def lattice(rings: int = 6) -> tuple[Paraboloid, Topology, Array]:
    """A paraboloid, a lattice of equal triangles with sides of 1 m, and the places of its rim on the paraboloid."""
    surface = Paraboloid(focal_length=FOCAL, diameter=2.0 * rings * SIDE)
    found = Rings(rings=rings, outline="polygon").topology("net", surface)
    return surface, found, np.column_stack([found.plan[found.rim], surface.height(*found.plan[found.rim].T)])


def net_of(rings: int = 3, **keys: Any) -> parts.Net:
    """A net of circles on a rim that stands still."""
    given: dict[str, Any] = {
        "surface": {"paraboloid": {"focal_length": FOCAL, "diameter": 10.0}}, "topology": {"rings": {"rings": rings}},
        "force_density": 10.0, "stiffness": 2e4, "node_mass": 0.01,
        "ties": {"anchors": {"length": 0.5, "stiffness": 5e3}},
    }  # fmt: skip
    return parts.Net(**(given | keys))


def system(part: parts.Net, **keys: Any) -> System:
    """A system of a net alone."""
    found = System(**keys)
    found.add(part, "net")
    return found


def test_lattice_on_a_paraboloid(book: Book) -> None:
    """Equal force densities and equal ties of 3 q l^2 / 2F bring all 91 free nodes onto the paraboloid."""
    surface, topology, rim = lattice()
    density, tension = np.full(len(topology.cords), 10.0), 3.0 * 10.0 * SIDE**2 / (2.0 * FOCAL)
    assert (len(topology.free), round(tension, 6)) == (91, 1.923077)
    x, _ = form.axial_form(topology, rim, density, form.Pull(None, tension))
    off = float(np.abs(x[:, 2] - surface.height(*x[:, :2].T)).max() + np.abs(x[:, :2] - topology.plan).max())
    book(
        CHAPTER, "Triangular lattice with equal ties", reference="on the paraboloid", source="closed form",
        error=off / SIDE, allowed=1e-12,
    )  # fmt: skip
    ties = form.axial_form(topology, rim, density, form.Pull(surface.height, 0.0))[1]
    np.testing.assert_allclose(ties, tension, rtol=1e-12)


def stored_of(program: str) -> dict[str, Any]:
    """Results of another program, of `benchmarks/peers/nets_with_*.py`."""
    found: dict[str, Any] = json.loads((pathlib.Path(__file__).parent / "data" / f"{program}.json").read_text("utf-8"))
    return found


@pytest.mark.parametrize(("program", "called"), [("compas_fd", "compas_fd 0.5.4"), ("jax_fdm", "jax-fdm 0.14.1")])
def test_forms_of_other_programs(program: str, called: str, book: Book) -> None:
    """A net between ribs, with uneven force densities and loads, against stored results of other programs."""
    stored = stored_of(program)
    start, cords, rim = np.array(stored["nodes"]), np.array(stored["cords"]), np.array(stored["rim"])
    edge = np.zeros(len(cords), dtype=bool)
    topology = Topology(start[:, :2], cords, np.zeros((0, 3), dtype=int), np.sort(rim), edge)
    density = np.array(stored["density"])
    x, _ = form.axial_form(topology, start[topology.rim], density, form.Pull(None, 0.3))
    tension = density * np.linalg.norm(np.diff(x[cords], axis=1)[:, 0], axis=1)
    off = max(np.abs(x - stored["x"]).max() / 10.0, np.abs(tension / stored["tension"] - 1.0).max())
    book(
        CHAPTER, "Net between eight ribs, nodes and tensions", reference=called, source="another code",
        error=float(off), allowed=1e-11,
    )  # fmt: skip


def test_gradient_of_jax_fdm(tmp_path: pathlib.Path, book: Book) -> None:
    """Derivatives of the rms by the lengths of elastic cords, against automatic differentiation of forms by jax-fdm."""
    stored = stored_of("jax_fdm")
    elastic, path = stored["elastic"], tmp_path / "ribs.json"
    path.write_text(json.dumps({key: stored[key] for key in ("nodes", "cords", "rim")} | {"facets": elastic["facets"]}))
    surface = {"paraboloid": {"focal_length": 4.0, "diameter": 10.0}}
    found = system(net_of(surface=surface, topology={"file": {"file": str(path)}}, ties=None)).reflector()
    np.testing.assert_allclose(found.cut_lengths, elastic["natural"], rtol=1e-12)
    assert found.error.half_path == pytest.approx(elastic["rms"], rel=1e-11)
    slopes = np.array(elastic["by_natural"])
    book(
        CHAPTER, "Rms of a net between ribs, derivatives by lengths", reference="jax-fdm 0.14.1",
        source="another code", error=float(np.abs(found.sensitivity - slopes).max() / np.abs(slopes).max()),
        allowed=1e-7,
    )  # fmt: skip


def test_facets_on_a_paraboloid(book: Book) -> None:
    """Mean offset l^2/16F and rms about it l^2/(16 sqrt(15) F) of equal triangles."""
    surface, topology, _ = lattice()
    x = np.column_stack([topology.plan, surface.height(*topology.plan.T)])
    found = error.surface_error(x, topology.facets, surface)
    about = np.sqrt(found.axial**2 - found.mean**2) / (SIDE**2 / (16.0 * np.sqrt(15.0) * FOCAL))
    book(
        CHAPTER, "Facets with corners on a paraboloid, mean and rms", reference="l^2/16F, l^2/(16 sqrt(15) F)",
        source="closed form", error=max(abs(found.mean * 16.0 * FOCAL / SIDE**2 - 1.0), abs(about - 1.0)), allowed=1e-6,
    )  # fmt: skip
    assert found.at_nodes < 1e-15
    assert found.facets == pytest.approx(found.mean, rel=1e-9)


def test_best_fit() -> None:
    """A paraboloid that is shifted, tilted and of another focal length is found again."""
    surface, topology, _ = lattice()
    shift, turn, focal = np.array([3e-3, -2e-3, 5e-3]), np.array([1e-3, -2e-3]), 7.83
    x = np.column_stack([topology.plan, (topology.plan**2).sum(axis=1) / (4.0 * focal)])
    c = Rotation.from_rotvec([*turn, 0.0]).as_matrix()
    points, weights = x @ c.T + shift, np.ones(len(x))
    fit = error.best_fit(points, weights, surface)
    assert fit.rms < 1e-10
    assert FOCAL / fit.scale == pytest.approx(focal, rel=1e-8)
    np.testing.assert_allclose(fit.shift, shift, atol=1e-7)
    np.testing.assert_allclose(fit.turn, turn, atol=1e-7)


def test_loss_of_gain() -> None:
    """Ruze: exp(-(4 pi e / lambda)^2); of e = lambda / 16 it is 2.68 dB."""
    assert error.ruze(error.LIGHT / 1e10 / 16.0, 1e10) == pytest.approx(10.0 / np.log(10.0) * (np.pi / 4.0) ** 2)


def test_formula_is_the_paraboloid() -> None:
    """The same surface by an expression."""
    one = Paraboloid(focal_length=2.5, diameter=4.0, offset=1.0)
    two = FormulaSurface(expression="(x**2 + y**2)/(4*F)", constants={"F": 2.5}, diameter=4.0, offset=1.0)
    x, y = np.array([0.3, 1.7, 2.9]), np.array([-1.0, 0.2, 0.4])
    np.testing.assert_allclose(two.height(x, y), one.height(x, y), rtol=1e-14)
    np.testing.assert_allclose(two.slopes(x, y), one.slopes(x, y), rtol=1e-9)


@pytest.mark.parametrize(
    "ties", [{"anchors": {"length": 0.5, "stiffness": 5e3}}, {"rear": {"gap": 0.4, "stiffness": 5e3}}]
)
def test_cut_lengths(ties: dict[str, Any]) -> None:
    """A net of elastic cords, cut for its form, is in equilibrium where the force densities have it."""
    found = system(net_of(ties=ties)).reflector()
    n = len(found.topology.plan)
    assert found.error.at_nodes < 1e-11
    np.testing.assert_allclose(
        found.tension[: len(found.topology.cords)], 10.0 * found.length[: len(found.topology.cords)], rtol=1e-9
    )
    assert found.x[:n][found.topology.rim] == pytest.approx(
        np.column_stack([found.topology.plan[found.topology.rim], np.full(18, 25.0 / (4.0 * FOCAL))]), abs=1e-12
    )


def test_wanted_tension() -> None:
    """All cords have the tension that is wanted."""
    found = system(net_of(force_density=None, tension=8.0)).reflector()
    inner = ~found.topology.edge
    np.testing.assert_allclose(found.tension[: inner.size], 8.0, rtol=1e-8)


def test_hanging_net() -> None:
    """A slack square net under gravity against its own force densities: another solution of the same equilibrium."""
    rows = 5
    plan = [[float(i), float(j)] for i in range(rows) for j in range(rows)]
    along = [[i * rows + j, i * rows + j + 1] for i in range(rows) for j in range(rows - 1)]
    cords = along + [[j * rows + i, (j + 1) * rows + i] for i in range(rows) for j in range(rows - 1)]
    rim = [k for k in range(rows**2) if k // rows in (0, rows - 1) and k % rows in (0, rows - 1)]
    edge = np.zeros(len(cords), dtype=bool)
    topology = Topology(np.array(plan), np.array(cords), np.zeros((0, 3), dtype=int), np.array(rim), edge)
    made = System(gravity=(0.0, 0.0, -9.81))
    for k, (x, y) in enumerate(plan):
        if k not in rim:
            made.add(parts.Point(mass=0.2, position=(x, y, -0.3)), f"node {k}")
    end = [(*plan[k], 0.0) if k in rim else f"node {k}" for k in range(rows**2)]
    for i, (a, b) in enumerate(cords):
        made.add(parts.Spring(a=end[a], b=end[b], stiffness=500.0, length=1.02, slack=True, damping=5.0), f"cord {i}")
    run = made.equilibrium()
    density = np.array(
        [float(run[f"cord {i}"]["force"][-1] / run[f"cord {i}"]["length"][-1]) for i in range(len(cords))]
    )
    D, free = form.densities(topology, density), topology.free
    x = np.zeros((rows**2, 3))
    x[rim] = np.column_stack([topology.plan[rim], np.zeros(4)])
    load = np.tile([0.0, 0.0, -0.2 * 9.81], (len(free), 1))
    x[free] = np.linalg.solve(D[free][:, free].toarray(), load - D[free][:, rim] @ x[rim])
    hung = np.array([run[f"node {k}"]["position"].values[-1] for k in free])
    np.testing.assert_allclose(x[free], hung, atol=1e-9)


def test_string_of_masses(tmp_path: pathlib.Path, book: Book) -> None:
    """Frequencies of strings of equal masses, 2 sqrt(T/ml) sin(k pi/2(n+1)), transverse."""
    n, tension, mass = 5, 12.0, 0.03
    nodes = [[x, y] for y in (0.0, 1.0, 2.0) for x in range(n + 2)]
    cords = [[s * (n + 2) + k, s * (n + 2) + k + 1] for s in range(3) for k in range(n + 1)]
    rim = [s * (n + 2) + k for s in range(3) for k in (0, n + 1)]
    path = tmp_path / "strings.json"
    path.write_text(json.dumps({"nodes": nodes, "cords": cords, "rim": rim}))
    flat = {"formula": {"expression": "0*x", "diameter": 12.0}}
    part = net_of(
        surface=flat, topology={"file": {"file": str(path)}}, force_density=tension, node_mass=mass, ties=None
    )
    found = np.sort(system(part).modes(count=3 * 2 * n).frequency_hz)
    k = np.arange(1, n + 1)
    wanted = np.sort(np.repeat(np.sqrt(tension / mass) / np.pi * np.sin(0.5 * k * np.pi / (n + 1)), 6))
    book(
        CHAPTER, "Strings of five masses, frequencies", reference="2 sqrt(T/ml) sin(k pi/12)", source="closed form",
        error=np.abs(found / wanted - 1.0).max(), allowed=1e-6,
    )  # fmt: skip


def wheel(count: int, tension: float, *, hollow: bool = False, net: bool = True) -> System:
    """A ring of straight bars with spokes, which a net of one ring is; flat, or on a paraboloid with ties."""
    radius, turn = 2.0, 2.0 * np.pi / count
    z = radius**2 / (4.0 * FOCAL) if hollow else 0.0
    corners = radius * np.stack([np.cos(turn * np.arange(count + 1)), np.sin(turn * np.arange(count + 1))], axis=1)
    made = System()
    for k in range(count):
        along = corners[k + 1] - corners[k]
        length = float(np.linalg.norm(along))
        made.add(
            parts.Rod(
                length=length, elements=2, section={"tube": {"radius": 0.02, "thickness": 0.001}}, material="cfrp",
                position=(*corners[k], z), direction=(*(along / length), 0.0), normal=(0.0, 0.0, 1.0),
            ), f"bar {k + 1}",
        )  # fmt: skip
    for k in range(count):
        made.add(
            parts.Joint(a=f"bar {k + 1}.tip", b=f"bar {(k + 1) % count + 1}.root", type="clamp"), f"corner {k + 1}"
        )
    for k in range(0, count, count // 3):
        place, out = (*corners[k], z), (*(corners[k] / radius), 0.0)
        made.add(parts.Joint(a=place, b=f"bar {k + 1}.root", type="point-on-line", axis=out), f"support {k}")
    surface: dict[str, Any] = {"formula": {"expression": "0*x", "diameter": 2.0 * radius}}
    if hollow:
        surface = {"paraboloid": {"focal_length": FOCAL, "diameter": 2.0 * radius}}
    ties = {"anchors": {"length": 0.5, "stiffness": 5e3}} if hollow else None
    if net:
        made.add(
            net_of(
                1, surface=surface, topology={"rings": {"rings": 1, "gores": count}}, force_density=tension / radius,
                edge=1e-9, ties=ties, rim=("bar",), node_mass=0.1,
            ), "net",
        )  # fmt: skip
    return made


def test_ring_that_shortens(book: Book) -> None:
    """A polygon of bars under the equal pull of its spokes shrinks by T / (2 EA sin(pi/n)), and does not bend."""
    count, tension = 12, 400.0
    made = wheel(count, tension)
    found = made.reflector()
    radius = float(np.linalg.norm(found.x[found.topology.rim], axis=1).mean())
    area = np.pi * (0.02**2 - 0.019**2)
    force = float(found.tension[found.topology.cords[:, 0] == 0].mean())
    wanted = force / (2.0 * np.sin(np.pi / count) * 69.7e9 * area)
    book(
        CHAPTER, "Ring of bars under its spokes, shortening", reference="T/(2 EA sin(pi/n))", source="closed form",
        error=abs((1.0 - radius / 2.0) / wanted - 1.0), allowed=2e-3,
    )  # fmt: skip
    spokes = found.topology.cords[:, 0] == 0
    cut = found.length[spokes] / (1.0 + found.tension[spokes] / 2e4)
    np.testing.assert_allclose(found.cut_lengths[spokes], cut, rtol=1e-9)


@pytest.mark.parametrize("rim", ["ground", "bars"])
def test_gradient(rim: str, book: Book) -> None:
    """The rms by the length of a cord, of one adjoint solution, against central differences of equilibria."""
    made = system(net_of(2)) if rim == "ground" else wheel(6, 30.0, hollow=True)
    own = NetInSystem(made.assemble(), "net")
    state = own.formed()
    square, slope = mean_square_slope(own, state)
    gradient, step, kept = own.response(state).gradient(slope), 1e-5, state.natural
    errors = []
    for k in (0, len(kept) // 2, len(kept) - 1):
        if state.tension[k] < 1e-3:
            continue
        values = []
        for sign in (1.0, -1.0):
            changed = kept.copy()
            changed[k] += sign * step
            own.cut(changed)
            values.append(mean_square_slope(own, own.equilibrium(state.y))[0])
        own.cut(kept)
        errors.append(abs(gradient[k] - (values[0] - values[1]) / (2.0 * step)))
    book(
        CHAPTER, f"Mean square error of a net by lengths, adjoint, rim of {rim}", reference="central differences",
        source="equilibria", error=max(errors) / float(np.abs(gradient).max()), allowed=1e-5,
    )  # fmt: skip
    assert square > 0.0


def test_adjusted_lengths(tmp_path: pathlib.Path) -> None:
    """Ties that were cut wrong are found from the measured nodes."""
    made = system(net_of(2))
    own = NetInSystem(made.assemble(), "net")
    state = own.formed()
    wrong = state.natural.copy()
    ties = np.arange(len(own.topology.cords), len(wrong))
    wrong[ties] += 1e-4 * np.cos(ties)
    own.cut(wrong)
    x = own.equilibrium(state.y).x
    path = tmp_path / "measured.csv"
    path.write_text("node,x,y,z\n" + "".join(f"{k},{a},{b},{c}\n" for k, (a, b, c) in enumerate(x[:19].tolist())))
    found = made.reflector(measured=str(path), adjust="ties").adjusted
    assert found is not None
    np.testing.assert_allclose(found.change, -1e-4 * np.cos(ties), atol=2e-6)
    assert found.after < 0.05 * found.before


def test_cut_file(tmp_path: pathlib.Path) -> None:
    """Lengths that were written are those of the net that reads them."""
    path = tmp_path / "cut.json"
    found = system(net_of(2)).reflector()
    found.save(path)
    again = system(net_of(2, cut=str(path))).reflector()
    np.testing.assert_allclose(again.x, found.x, atol=1e-11)


def test_heat() -> None:
    """A net on a rim that stands still: heat adds the tension of a strain; without expansion nothing changes."""
    found = system(net_of(2, thermal_expansion=1e-5)).reflector(temperature=-50.0)
    still = system(net_of(2, thermal_expansion=0.0)).reflector(temperature=-50.0)
    assert still.warm is not None
    assert found.warm is not None
    assert still.warm.fit.shift[2] == pytest.approx(still.error.fit.shift[2], rel=1e-7)
    assert abs(found.warm.fit.shift[2] - found.error.fit.shift[2]) > 1e-7


def test_tolerance() -> None:
    """The bound of an error of lengths that is allowed is the limit."""
    made = system(net_of(2))
    limit = 1.5 * made.reflector().error.fit.rms
    allowed = made.reflector(limit=limit).tolerance.allowed
    assert allowed is not None
    assert made.reflector(length_error=allowed).tolerance.bound == pytest.approx(limit, rel=1e-9)
    assert made.reflector(limit=1e-6).tolerance.allowed == 0.0


def test_gores() -> None:
    """Nodes on the ribs are held, and all cords of a net without ties have tension."""
    surface = Paraboloid(focal_length=FOCAL, diameter=10.0)
    found = Gores(ribs=12, stations=4, across=3, inner_radius=0.6).topology("net", surface)
    assert len(found.rim) == 12 * 5
    radii = np.linalg.norm(found.plan[found.rim], axis=1)
    assert sorted(set(radii.round(9))) == pytest.approx([0.6, 1.7, 2.8, 3.9, 5.0])


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"rim": ("bar",)}, "no part is called 'bar'"),
        ({"force_density": None}, "force_density is missing"),
        ({"node_mass": 0.0}, "mass_per_length"),
        ({"surface": {"formula": {"expression": "-0.02*(x**2 + y**2)", "diameter": 10.0}}}, "would have to push"),
        ({"topology": {"gores": {"ribs": 6, "stations": 2, "inner_radius": 6.0}}}, "below the radius"),
    ],
)
def test_refusals(keys: dict[str, Any], sentence: str) -> None:
    """What no net can be is refused by one sentence."""
    with pytest.raises(InputError, match=sentence):
        system(net_of(2, **keys)).assemble()


def test_a_rim_on_several_bodies_is_refused() -> None:
    """The ground beside rods, of which one alone would have been used."""
    made = wheel(6, 1.0, net=False)
    made.add(net_of(1, rim=("ground", "bar 1")), "net")
    with pytest.raises(InputError, match="one rigid body or the ground holds the whole rim"):
        made.assemble()


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("{nodes: 1", "is no JSON"),
        ("[1, 2]", "must have the keys nodes, cords and rim"),
        ('{"nodes": [[0, 0]], "cords": [[0, "a"]], "rim": [0]}', "cords must be a list of rows"),
        ('{"nodes": [[0, 0], [1, 0]], "cords": [[0, 1]], "rim": "ab"}', "rim must be a list of numbers"),
        ('{"nodes": [[0, 0], [1, 0]], "cords": [[0, 7]], "rim": [0]}', "none of 0 to 1"),
    ],
)
def test_files_that_are_no_nets_are_refused(text: str, sentence: str, tmp_path: pathlib.Path) -> None:
    path = tmp_path / "net.json"
    path.write_text(text)
    with pytest.raises(InputError, match=sentence):
        system(net_of(2, topology={"file": {"file": str(path)}})).assemble()


def test_refused_reflectors() -> None:
    """A system without a net, and temperatures without expansion."""
    with pytest.raises(InputError, match="no net"):
        wheel(6, 1.0, net=False).reflector()
    with pytest.raises(InputError, match="thermal_expansion is missing"):
        system(net_of(2)).reflector(temperature=10.0)


def test_a_net_that_moves(book: Book) -> None:
    """The energy balance of a net that is released from another form, while some of its cords go slack."""
    made = system(net_of(2, force_density=0.1, damping=1e-4, node_mass=0.05), gravity=(0.0, 0.0, 30.0))
    run = made.simulate(until=0.3, method="energy-momentum", step=1e-3, spectral_radius=1.0)
    moved, defect = float(run["energy_moved"].values[-1]), float(np.abs(run["energy_defect"].values).max())
    book(
        CHAPTER, "A net that swings and goes slack, energy balance", reference="closed", source="invariant",
        error=defect / moved, allowed=1e-9,
    )  # fmt: skip
    assert int(run["net"]["slack_cords"].max()) > 0


def test_rims_of_bodies_and_shells(tmp_path: pathlib.Path) -> None:
    """A net held by a body is that on the ground; on a plate that yields, its pull is held by the plate's clamp."""
    fixed = system(net_of(2)).reflector()
    made = System()
    made.add(parts.RigidBody(motion="driven", rate=0.0, position=(0.3, 0.0, -1.0)), "bus")
    made.add(net_of(2, rim=("bus",)), "net")
    np.testing.assert_allclose(made.reflector().x, fixed.x, atol=1e-11)
    path = tmp_path / "cross.json"
    nodes, cords = [[0.0, 0.0], [0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]], [[0, k] for k in range(1, 5)]
    path.write_text(json.dumps({"nodes": nodes, "cords": cords, "rim": [1, 2, 3, 4]}))
    plate = System()
    plate.add(
        parts.Shell(
            size=(1.0, 1.0), elements=(2, 2), thickness=5e-3, material="aluminium", position=(-0.5, -0.5, 0.0),
            clamped=["x0"],
        ), "plate",
    )  # fmt: skip
    flat = {"formula": {"expression": "0*x", "diameter": 2.0}}
    plate.add(net_of(surface=flat, topology={"file": {"file": str(path)}}, ties=None, rim=("plate",)), "net")
    state = NetInSystem(plate.assemble(), "net").formed()
    np.testing.assert_allclose(state.tension, 10.0 * state.length[:4], rtol=1e-9)
    assert np.abs(state.x[1:] - np.column_stack([nodes[1:], np.zeros(4)])).max() > 1e-9
