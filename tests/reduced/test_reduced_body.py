"""Reduced flexible bodies against their matrices, closed forms, and the same structure in full."""

from __future__ import annotations

import dataclasses
import pathlib

import numpy as np
import pytest
import scipy.linalg

from evolvent import InputError, System, elements, parts
from evolvent.elements.reduced_files import read_model, write_model
from evolvent.elements.reduced_models import ReducedModel, check_model, mean_axes
from reduced.beam_model import AREA, DENSITY, I_Z, LENGTH, MASS, POLAR, YOUNG, beam, reduced

Array = np.ndarray
ORIGIN = (0.0, 0.0, 0.0)


@pytest.fixture(name="model", scope="module")
def _model() -> ReducedModel:
    return reduced()


@pytest.fixture(name="path", scope="module")
def _path(model: ReducedModel, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = str(tmp_path_factory.mktemp("models") / "beam.npz")
    write_model(path, model)
    return path


def clamped(path: str, **keys: object) -> System:
    """The beam, with its root clamped at the origin."""
    found = System()
    found.add(parts.ReducedBody(file=path, **keys), "beam")
    found.add(parts.Joint(a=ORIGIN, b="beam.root", type="clamp"), "root")
    return found


# ------------------------------------------------------------------------------------------------ matrices


def test_mean_axes_keep_mass_inertia_and_frequencies(model: ReducedModel) -> None:
    """m, J about the middle, and every eigenvalue of the free pencil (K, M)."""
    check_model(model, "beam")
    found = mean_axes(model, "beam")
    nodes = found.node_mass * 2
    assert found.mass + nodes == pytest.approx(MASS, rel=1e-12)
    assert found.centre == pytest.approx([0.5 * LENGTH, 0.0, 0.0], abs=1e-10)
    across = np.diag(found.inertia)[1:] + nodes * (0.5 * LENGTH) ** 2 + 2 * found.node_inertia
    assert across == pytest.approx(np.full(2, MASS * LENGTH**2 / 12.0), rel=1e-9)
    about = found.inertia[0, 0] + 2 * found.node_inertia
    assert about == pytest.approx(DENSITY * POLAR * LENGTH, rel=1e-9)


def test_a_held_body_has_the_frequencies_of_its_matrices(model: ReducedModel, path: str) -> None:
    exact = np.sqrt(scipy.linalg.eigh(model.stiffness[6:, 6:], model.mass[6:, 6:], eigvals_only=True)[:6])
    assert 2.0 * np.pi * clamped(path).modes(count=6).frequency_hz == pytest.approx(exact, rel=1e-9)
    assert mean_axes(model, "beam").held == pytest.approx(exact[0], rel=1e-9)


def test_a_body_held_at_all_nodes(model: ReducedModel, path: str) -> None:
    """In a loop through the ground: the frequencies of its matrices without the nodes, and half of a load on each."""
    system = System(gravity=(0.0, 0.0, -1e-3))
    system.add(parts.ReducedBody(file=path), "beam")
    for end, place in (("root", ORIGIN), ("tip", (LENGTH, 0.0, 0.0))):
        system.add(parts.Joint(a=place, b=f"beam.{end}", type="clamp"), end)
    exact = np.sqrt(scipy.linalg.eigh(model.stiffness[12:, 12:], model.mass[12:, 12:], eigvals_only=True)[:4])
    assert 2.0 * np.pi * system.modes(count=4).frequency_hz == pytest.approx(exact, rel=1e-9)
    run = system.equilibrium()
    for joint in ("root", "tip"):
        assert run[joint]["force"].values[-1, 2] == pytest.approx(0.5e-3 * MASS, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), (0.48, -0.6, 0.64)])
def test_frequencies_do_not_depend_on_the_attitude(path: str, axis: tuple[float, float, float]) -> None:
    turned = clamped(path, orientation={"axis": list(axis), "angle": "100 deg"})
    assert turned.modes(count=4).frequency_hz == pytest.approx(clamped(path).modes(count=4).frequency_hz, rel=1e-9)


@pytest.mark.slow
def test_section_loads_by_recovery(path: str) -> None:
    """A small load across at the tip: w = F L^3/(3 E I), and F and F L at the root of the first element."""
    force, system = 0.01, clamped(path)
    system.add(parts.Load(at="beam.tip", force=(0.0, force, 0.0)), "load")
    run = system.equilibrium()
    moved = run["beam/interface_position"].values[-1, 1, 1]
    assert moved == pytest.approx(force * LENGTH**3 / (3.0 * YOUNG * I_Z), rel=1e-5)
    assert float(run["beam/root_shear"].values[-1]) == pytest.approx(-force, rel=1e-5)
    assert float(run["beam/root_moment"].values[-1]) == pytest.approx(-force * LENGTH, rel=1e-5)
    on_joint = run["beam/force"].values[-1, 0]
    assert on_joint == pytest.approx([0.0, force, 0.0], abs=1e-8)


# ------------------------------------------------------------------------------------------------ reduced and full

ALLOY = elements.Material(young_modulus=70e9, poisson_ratio=0.3, density=1600.0)
TUBE = elements.Tube(radius=0.01, thickness=0.0003)


def rod(system: System) -> None:
    """A boom in full."""
    system.add(parts.Rod(length=3.0, section=TUBE, material=ALLOY, elements=8, position=(0.2, 0.0, 0.0)), "boom")


@pytest.fixture(name="boom", scope="module")
def _boom(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The boom as a reduced body, made by our own linear model."""
    path = str(tmp_path_factory.mktemp("models") / "boom.json")
    free = System()
    rod(free)
    linear = free.linearize([], [], modes=20, method="craig-bampton", boundary=["boom.root", "boom.tip"])
    linear.reduced_body({"root": "boom.root", "tip": "boom.tip"}, path)
    return path


@pytest.mark.slow
def test_a_boom_reduced_and_full_has_the_same_frequencies(boom: str) -> None:
    found = []
    for full in (True, False):
        system = System()
        if full:
            rod(system)
        else:
            system.add(parts.ReducedBody(file=boom), "boom")
        system.add(parts.Joint(a=(0.2, 0.0, 0.0), b="boom.root", type="clamp"), "root")
        found.append(system.modes(count=6).frequency_hz)
    assert found[1] == pytest.approx(found[0], rel=1e-6)


@pytest.mark.slow
def test_a_boom_reduced_and_full_slews_alike(boom: str) -> None:
    """A torque turns a hub by 60 deg, and the boom bends by 2 mm: its tip, of the way that it goes."""
    places = []
    for full in (True, False):
        system = System()
        system.add(parts.RigidBody(mass=20.0, inertia=(1.2, 1.2, 2.0), points={"bracket": (0.2, 0.0, 0.0)}), "hub")
        if full:
            rod(system)
        else:
            system.add(parts.ReducedBody(file=boom), "boom")
        system.add(parts.Joint(a="hub.bracket", b="boom.root", type="clamp"), "clamp")
        torque = [(0.0, 0.0), (1.0, 0.6), (2.0, 0.0)]
        system.add(parts.Load(at="hub", axis=(0.0, 0.0, 1.0), profile=torque), "slew")
        run = system.simulate(until=5.0, every=0.05, method="energy-momentum", tolerance=1e-8)
        assert run.attrs["status"] == "success", run.attrs["message"]
        places.append(run["boom/position" if full else "boom/interface_position"].values[:, -1])
    way = np.linalg.norm(np.diff(places[0], axis=0), axis=1).sum()
    assert way > 2.5
    assert np.abs(places[1] - places[0]).max() < 1e-4 * way


# ------------------------------------------------------------------------------------------------ invariants


@pytest.mark.slow
@pytest.mark.parametrize("step", [0.02, 0.2, 1.0])
def test_a_tumbling_body_keeps_energy_and_momenta(path: str, step: float) -> None:
    """Under energy-momentum without dissipation, whatever the step: two beams on a spring, that tumble."""
    system = System()
    system.add(parts.ReducedBody(file=path, angular_velocity=(0.1, -0.2, 0.3), velocity=(0.0, -0.1, 0.0)), "a")
    system.add(parts.ReducedBody(file=path, position=(LENGTH + 0.1, 0.0, 0.0), velocity=(0.0, 0.5, 0.3)), "b")
    spring = parts.Spring(a="a.tip", b="b.root", stiffness=30.0, length=0.3)
    system.add(spring, "spring")
    run = system.simulate(until=20.0 * step, every=step, method="energy-momentum", step=step, spectral_radius=1.0)
    assert run.attrs["status"] == "success", run.attrs["message"]
    energy, linear, angular = run["energy"].values, run["momentum"].values, run["angular_momentum"].values
    assert np.ptp(energy) < 1e-9 * energy.max()
    assert np.abs(linear - linear[0]).max() < 1e-11 * np.abs(linear).max()
    assert np.abs(angular - angular[0]).max() < 1e-9 * np.abs(angular).max()
    assert run["a/mode_amplitude"].values.max() > 1e-5


@pytest.mark.slow
def test_damping_of_modes(path: str) -> None:
    ratio = 0.02
    model, found = reduced(), clamped(path, damping_ratio=ratio).modes(count=2, damped=True)
    free = mean_axes(model, "beam")
    shapes = free.shapes / np.sqrt(MASS)
    damping = 2.0 * ratio * np.diag(np.sqrt(free.square))
    inverse = np.linalg.lstsq(np.hstack([shapes, model.rigid_motions]), np.eye(model.size), rcond=None)[0]
    C = inverse[: free.square.size].T @ damping @ inverse[: free.square.size]
    K, M = model.stiffness[6:, 6:], model.mass[6:, 6:]
    w, u = scipy.linalg.eigh(K, M, subset_by_index=[0, 1])
    wanted = np.einsum("ik,ij,jk->k", u, C[6:, 6:], u) / (2.0 * np.sqrt(w))
    assert found.damping_ratio == pytest.approx(wanted, rel=1e-3)


@pytest.mark.slow
def test_fast_spin_is_warned_of(path: str) -> None:
    for rate, warns in ((0.5, False), (3.0, True)):
        system = System()
        system.add(parts.ReducedBody(file=path, angular_velocity=(0.0, 0.0, rate)), "beam")
        run = system.simulate(until=0.1, every=0.1, method="generalized-alpha")
        assert ("which its linear model does not have" in run.attrs.get("warning", "")) == warns
        held = mean_axes(reduced(), "beam").held
        assert float(run["beam/spin_ratio"].values[0]) == pytest.approx(rate / held, rel=1e-9)


# ------------------------------------------------------------------------------------------------ files


@pytest.mark.parametrize("ending", [".npz", ".json"])
def test_files_keep_a_model(model: ReducedModel, tmp_path: pathlib.Path, ending: str) -> None:
    path = str(tmp_path / f"beam{ending}")
    write_model(path, model)
    found = read_model(path)
    for field in dataclasses.fields(ReducedModel):
        kept, given = getattr(found, field.name), getattr(model, field.name)
        assert np.array_equal(kept, given) if isinstance(given, np.ndarray) else kept == given


def test_results_are_those_of_the_file_that_was_read(model: ReducedModel, tmp_path: pathlib.Path) -> None:
    """A file that changes or goes after the assembly changes no result, and the next run reads it."""
    path = tmp_path / "beam.npz"
    write_model(str(path), model)
    system = clamped(str(path))
    first = system.modes(count=2).frequency_hz
    run = system.simulate(until=1e-3, every=1e-3, method="generalized-alpha", step=1e-3)
    write_model(str(path), dataclasses.replace(model, stiffness=4.0 * model.stiffness))
    assert system.modes(count=2).frequency_hz == pytest.approx(2.0 * first, rel=1e-9)
    path.unlink()
    assert run["beam"]["displacement"].shape == (2, 2, 3)


def test_units_of_a_file(model: ReducedModel, tmp_path: pathlib.Path) -> None:
    """A file in millimetres and tonnes (with newtons) holds the same body."""
    path = str(tmp_path / "beam.npz")
    write_model(path, model.scaled(1e3, 1e-3))
    found = read_model(path, 1e-3, 1e3)
    assert found.stiffness[:12, :12] == pytest.approx(model.stiffness[:12, :12], rel=1e-12)
    assert mean_axes(found, "").square == pytest.approx(mean_axes(model, "").square, rel=1e-6)
    assert found.positions == pytest.approx(model.positions)
    given = parts.ReducedBody(file=path, length_unit=1e-3, mass_unit=1e3, expected_mass=MASS)
    right = System()
    right.add(given, "beam")
    assert right.assemble().model.bodies["mass"].sum() == pytest.approx(MASS)
    wrong = System()
    wrong.add(parts.ReducedBody(file=path, expected_mass=MASS), "beam")
    with pytest.raises(InputError, match=r"expected_mass is 2.7 kg, but .* has 0.0027 kg; give the units"):
        wrong.assemble()


def _unsymmetric(model: ReducedModel) -> ReducedModel:
    K = model.stiffness.copy()
    K[3, 7] += 1e-3 * K.max()
    return dataclasses.replace(model, stiffness=K)


def _held(model: ReducedModel) -> ReducedModel:
    return dataclasses.replace(model, stiffness=model.stiffness + np.eye(model.size))


def _moved(model: ReducedModel) -> ReducedModel:
    return dataclasses.replace(model, positions=model.positions * [0.9, 1.0, 1.0])


def _degrees(model: ReducedModel) -> ReducedModel:
    M = model.mass.copy()
    M[0, 0] *= 1.1
    return dataclasses.replace(model, mass=M)


def _few(model: ReducedModel) -> ReducedModel:
    return dataclasses.replace(model, positions=np.zeros((5, 3)))


def _massless(model: ReducedModel) -> ReducedModel:
    M = model.mass.copy()
    M[-1], M[:, -1] = 0.0, 0.0
    return dataclasses.replace(model, mass=M)


def _negative(model: ReducedModel) -> ReducedModel:
    M = model.mass.copy()
    M[-1, -2] = M[-2, -1] = 2.0 * np.sqrt(M[-1, -1] * M[-2, -2])
    return dataclasses.replace(model, mass=M)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (_unsymmetric, "the stiffness is not symmetric: entries 3, 7 and 7, 3 are"),
        (_held, "strains the model: its energy is .* the model must not be held"),
        (_moved, "a rotation about [yz] strains the model"),
        (_degrees, "its mass differs by .* kg with the direction"),
        (_few, "the matrices have 22 coordinates, but 5 interface nodes need 30"),
        (_massless, "coordinate 21 of the modes has the mass 0"),
        (_negative, "its mass matrix is negative along a motion"),
        (lambda m: dataclasses.replace(m, stiffness=m.stiffness * np.nan), "the stiffness has entries that are not"),
        (lambda m: dataclasses.replace(m, mass=m.mass[:5, :5]), "the mass has the shape"),
        (lambda m: dataclasses.replace(m, recovery=np.ones((1, 3))), "the recovery matrix has the shape"),
    ],
)
def test_matrices_that_are_no_free_body_are_refused(model: ReducedModel, change, sentence: str) -> None:  # type: ignore[no-untyped-def]
    def check(changed: ReducedModel) -> None:
        check_model(changed, "'beam.npz'")
        mean_axes(changed, "'beam.npz'")

    with pytest.raises(InputError, match=sentence):
        check(change(model))


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ({"mas": 1.0}, "has the key 'mas'; did you mean 'mass'"),
        ({"names": ["root"]}, "names has 1 entries; it must have 2"),
        ({"names": ["root", "root"]}, "names has one name twice"),
        ({"mass": "heavy"}, "mass is no array of real numbers"),
    ],
)
def test_keys_of_a_file_are_checked(
    model: ReducedModel, tmp_path: pathlib.Path, keys: dict[str, object], sentence: str
) -> None:
    content = {"stiffness": model.stiffness, "mass": model.mass, "positions": model.positions} | keys
    path = str(tmp_path / "beam.npz")
    np.savez(path, **content)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=sentence):
        read_model(path)


def test_files_that_are_none_are_refused(tmp_path: pathlib.Path) -> None:
    for name, raw, sentence in (
        ("beam.txt", b"", r"must end with \.npz, \.json, \.op4"),
        ("beam.npz", b"no archive", "it is no archive of NumPy"),
        ("beam.json", b"[1, 2]", "is no object of JSON"),
        ("beam.json", b"{", "cannot read"),
    ):
        path = tmp_path / name
        path.write_bytes(raw)
        with pytest.raises(InputError, match=sentence):
            read_model(str(path))
    with pytest.raises(InputError, match="cannot read"):
        read_model(str(tmp_path / "none.npz"))


@pytest.mark.parametrize(
    ("where", "sentence"),
    [("beam.tips", "has no node 'tips'; did you mean 'tip'"), ("beam", "names no interface"), ("beam[2]", "no node 2")],
)
def test_nodes_are_found_by_name(path: str, where: str, sentence: str) -> None:
    system = System()
    system.add(parts.ReducedBody(file=path), "beam")
    system.add(parts.Joint(a=ORIGIN, b="beam[0]", type="clamp"), "by number")
    system.assemble()
    system.add(parts.Load(at=where, force=(1.0, 0.0, 0.0)), "force")
    with pytest.raises(InputError, match=sentence):
        system.assemble()


def one_node(held: float = 0.0) -> ReducedModel:
    """The beam with its root as the one interface node, whose stiffness is round-off, or that of a spring to ground."""
    n, modes = 40, 12
    K, M = beam(n)
    rest = np.arange(6, len(K))
    _, Phi = scipy.linalg.eigh(K[np.ix_(rest, rest)], M[np.ix_(rest, rest)], subset_by_index=[0, modes - 1])
    T = np.zeros((len(K), 6 + modes))
    T[:6, :6] = np.eye(6)
    T[rest, :6] = -np.linalg.solve(K[np.ix_(rest, rest)], K[np.ix_(rest, np.arange(6))])
    T[rest, 6:] = Phi
    reduced_K = T.T @ K @ T
    reduced_K[:3, :3] += held * np.eye(3)
    found = [0.5 * (one + one.T) for one in (reduced_K, T.T @ M @ T)]
    return ReducedModel(found[0], found[1], np.zeros((1, 3)), ("root",), np.zeros((0, 6 + modes)))


def test_one_interface_node_is_enough(tmp_path: pathlib.Path) -> None:
    """Stiffness of the node that is round-off of the finite-element model does not count as held."""
    model = one_node()
    assert np.abs(model.stiffness[:6, :6]).max() > 0.0
    write_model(str(tmp_path / "one.npz"), model)
    free = System()
    free.add(parts.ReducedBody(file=str(tmp_path / "one.npz")), "beam")
    found = free.modes(count=8).frequency_hz
    bending = 4.730041**2 * np.sqrt(YOUNG * I_Z / (DENSITY * AREA * LENGTH**4)) / (2.0 * np.pi)
    assert np.abs(found[:6]).max() < 1e-3
    assert found[6] == pytest.approx(bending, rel=1e-3)
    for held in (1e-2, 1.0, 1e3):
        with pytest.raises(InputError, match="a translation along x strains the model"):
            check_model(one_node(held), "the model")


def test_an_exported_boom_with_one_interface_node(tmp_path: pathlib.Path) -> None:
    free = System()
    rod(free)
    model = free.linearize(modes=10, method="craig-bampton", boundary=["boom.root"], inputs=[], outputs=[])
    path = str(tmp_path / "own.npz")
    model.reduced_body({"root": "boom.root"}, path)
    body = System()
    body.add(parts.ReducedBody(file=path), "boom")
    assert body.modes(count=8).frequency_hz[6:] == pytest.approx(free.modes(count=8).frequency_hz[6:], rel=2e-2)
