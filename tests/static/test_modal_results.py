"""Effective masses, shapes by part and displaced states against closed forms and independent computations."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from evolvent import InputError, System, model as mdl, parts
from evolvent.analysis.modal import ModalResults
from evolvent.elements import General, Material, Rectangle
from evolvent.kernels.blocks import displace
from evolvent.kernels.rotations import rotation_from_quaternion
from evolvent.parts.base import unit
from evolvent.solvers.common.observations import sums_of
from evolvent.solvers.modal.modes import modes
from evolvent.solvers.modal.positions import linearized_points, rigid_motions
from evolvent_base.answer import Table
from helpers import rotation
from static.composing import STEEL, beam

BAR = Rectangle(thickness=1e-3, width=2e-3)
MASS = STEEL.density * 2e-6
#: b L of a clamped beam and (cosh b + cos b)/(sinh b + sin b).
CLAMPED = ((1.87510407, 0.73409551), (4.69409113, 1.01846732), (7.85475744, 0.99922450))


def mixed() -> System:
    """A free body with an attitude, a body on an axis, a point, a cable and a beam, on springs."""
    system = System()
    turned = unit((0.8, 0.3, -0.4, 0.2))
    system.add(parts.RigidBody(mass=3.0, inertia=(0.2, 0.3, 0.4), position=(0.3, -0.2, 0.5), orientation=turned), "hub")
    system.add(parts.RigidBody(motion="spin", inertia=0.7, position=(0.0, 0.0, -1.0), axis=(0.0, 0.6, 0.8)), "wheel")
    system.add(parts.Point(mass=0.4, position=(-0.6, 0.7, 0.1)), "mass")
    common = {"length": 1.0, "section": Rectangle(thickness=0.05, width=0.08), "elements": 2}
    soft = Material(young_modulus=1e5, poisson_ratio=0.3, density=900.0)
    system.add(parts.Beam(position=(0.2, 0.0, 0.0), direction=(0.6, 0.8, 0.0), normal=(-0.8, 0.6, 0.0),
                          material=soft, formulation="cable", **common), "cable")  # fmt: skip
    system.add(parts.Beam(position=(0.0, 0.2, 0.0), direction=(0.0, 0.6, 0.8), normal=(1.0, 0.0, 0.0), material=soft,
                          formulation="assumed_strain", **common), "rib")  # fmt: skip
    for place in ("hub", "wheel"):
        system.add(parts.Spring(a="mass", b=(place, (0.1, 0.2, 0.3)), stiffness=30.0, length=1.0))
    return system


# ------------------------------------------------------------------------------------------------ effective masses


@pytest.mark.parametrize(("formulation", "count"), [("cable", 24), ("assumed_strain", 32)])
def test_effective_masses_of_a_cantilever(formulation, count, book):
    """4 s^2/b^2 of the mass, 12/b^4 of the moment of inertia about the root: 61.3 % and 97.1 % in the first mode."""
    found = modes(beam(formulation, count, section=BAR), count=12)
    assert_allclose(found.total_mass[:3], MASS, rtol=1e-12)
    assert_allclose(found.total_mass[4:], MASS / 3.0, rtol=1e-5)  # and the rotational inertia of the section
    assert_allclose(found.frequency_hz, found.frequency / (2.0 * np.pi))
    errors = []
    for axis, about in ((1, 5), (2, 4)):
        bending = np.flatnonzero(found.effective_mass[:, axis] > 1e-6 * MASS)[: len(CLAMPED)]
        wanted = np.array([[4.0 * s**2 / b**2, 12.0 / b**4] for b, s in CLAMPED])
        fractions = found.effective_mass[bending][:, [axis, about]] / found.total_mass[[axis, about]]
        assert wanted[0] == pytest.approx([0.6131, 0.9707], abs=1e-4)
        errors.append(np.abs(fractions - wanted).max())
        assert_allclose(found.effective_mass[bending][:, [0, 3, 3 - axis]], 0.0, atol=1e-9 * MASS)
    book(
        "Modes", f"Cantilever, effective masses of three modes ({formulation}, {count} elements)",
        reference="4 s^2/b^2, 12/b^4", source="closed form (Euler's beam)", error=max(errors), allowed=1e-3,
    )  # fmt: skip


@pytest.mark.parametrize("formulation", ["cable", "assumed_strain"])
def test_effective_masses_of_all_modes_sum_to_the_mass_that_can_move(formulation):
    shares = []
    for count in (4, 8):
        found = modes(beam(formulation, count, section=BAR), count=1000)
        free = found.movable_mass > 0.0
        assert list(free) == [True, True, True, formulation != "cable", True, True]  # a cable has no twist
        assert_allclose(found.effective_mass.sum(axis=0)[free], found.movable_mass[free], rtol=1e-9)
        assert_allclose(found.cumulative_fraction[-1, free], 1.0, rtol=1e-9)
        assert np.all(np.isnan(found.cumulative_fraction[:, ~free]))
        shares.append(1.0 - found.movable_mass[1] / found.total_mass[1])
    # what the support carries of the first element goes with its length
    assert 0.0 < shares[0] < 0.3 / 4
    assert_allclose(shares[0] / shares[1], 2.0, rtol=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("count", [8, 32])  # dense and sparse algebra
def test_rigid_body_modes_of_a_free_beam_carry_everything(count):
    section = General(area=1e-4, Iy=2e-9, Iz=1e-9, J=5e-10)
    found = modes(beam("assumed_strain", count, (), section=section), count=12)
    rigid = found.frequency == 0.0
    assert np.sum(rigid) == 6
    assert_allclose(found.effective_mass[rigid].sum(axis=0), found.total_mass, rtol=1e-9)
    assert_allclose(found.movable_mass, found.total_mass, rtol=1e-12)
    assert np.all(found.effective_mass[~rigid] < 1e-9 * found.total_mass)
    m = STEEL.density * 1e-4
    wanted = [m, m, m, STEEL.density * 3e-9, m / 3.0 + STEEL.density * 2e-9, m / 3.0 + STEEL.density * 1e-9]
    assert_allclose(found.total_mass, wanted, rtol=1e-9)
    # translations along x, y, z, then rotations about axes through the centre of mass
    centre = found.about((0.5, 0.0, 0.0)).effective_mass[:6]
    assert_allclose(centre, np.diag(np.diag(centre)), atol=1e-9 * m)
    assert_allclose(np.diag(centre)[3:], [wanted[3], m / 12.0 + wanted[4] - m / 3.0, m / 12.0 + wanted[5] - m / 3.0])
    assert_allclose(found.shape @ (found.M @ found.shape.T), np.eye(12), atol=1e-6)


def test_what_a_pendulum_leaves_to_its_support():
    system = System(gravity=(0.0, 0.0, -9.81))
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.3), position=(0.0, 0.0, -1.5)), "bob")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("bob", (0.0, 0.0, 1.5))), "pivot")
    found = modes(system.assemble())
    Ix, Iy = 0.1 + 4.5, 0.2 + 4.5
    assert_allclose(found.total_mass, [2.0, 2.0, 2.0, Ix, Iy, 0.3], rtol=1e-12)
    assert_allclose(found.movable_mass, [9.0 / Iy, 9.0 / Ix, 0.0, Ix, Iy, 0.3], rtol=1e-9)
    assert_allclose(found.effective_mass.sum(axis=0), found.movable_mass, atol=1e-9)
    swing = found["bob"]
    assert_allclose(swing.displacement, np.cross(swing.rotation, [0.0, 0.0, -1.5]), atol=1e-9)
    assert_allclose(np.sort(found.frequency), [0.0, *np.sqrt(2.0 * 9.81 * 1.5 / np.array([Iy, Ix]))], atol=1e-6)


@pytest.mark.slow
def test_complex_modes_have_no_effective_masses():
    found = modes(beam("cable", 4, section=BAR, mass_damping=0.1), count=4, damped=True)
    assert np.iscomplexobj(found.shape)
    with pytest.raises(InputError, match="effective masses are defined for real modes"):
        _ = found.effective_mass
    assert "mass x" not in str(ModalResults.of(found))
    seen = found.to_dataset()
    for text in (str(ModalResults.of(found)), seen.attrs["comment"]):
        assert "these are complex, since the structure has damping" in text
    assert found.warning == ""
    assert seen["beam.displacement"].dims == ("component", "mode", "beam.node", "axis")


def test_a_torque_along_a_beam_makes_modes_grow():
    """s^2 = -w^2 + i T/J and its conjugate: a force per mass of T/J times axis x arm, J that of the sections."""
    side, torque = 2e-3, 1e-4
    rate = torque / (2.0 * side**4 / 12.0 * STEEL.density)
    square = Rectangle(thickness=side, width=side)
    w = modes(beam("assumed_strain", 2, section=square), count=4).frequency
    twist = parts.Load(along="beam", torque=(torque, 0.0, 0.0))
    found = modes(beam("assumed_strain", 2, section=square, more=lambda it: it.add(twist, "twist")), count=4)
    assert_allclose((found.pole**2).real, -(w**2), rtol=1e-6)
    assert_allclose(np.abs((found.pole**2).imag), rate, rtol=1e-4)  # the equilibrium is twisted
    grow = np.flatnonzero(found.pole.real > 0.0)
    assert len(grow) == 2
    shown = str(ModalResults.of(found))
    assert "warning: 2 modes grow (real part of the pole above 0): " in shown
    for k in grow:
        assert f"mode {k} by {found.pole[k].real:.4g} 1/s, which moves 'beam' most" in shown
    assert shown.count("forces without a potential ('twist')") == 2  # why they grow, and why there are no masses


def test_round_off_is_shown_as_0():
    """Damping of a free structure that turns, with three equal poles at its rate, and masses that no mode moves."""
    system = System()
    for k, x in enumerate((-0.5, 0.3, 0.7)):
        system.add(parts.Point(mass=1.0 + k, position=(x, 0.0, 0.0)), f"mass {k}")
    for a, b in ((0, 1), (1, 2)):
        system.add(parts.Spring(a=f"mass {a}", b=f"mass {b}", stiffness=50.0 + a, length=0.4), f"spring {a}")
    found = system.modes(count=9, rotating=(0.0, 0.0, 1.0))
    assert np.iscomplexobj(found.shape)
    assert "the structure has gyroscopic forces" in str(found)
    assert_allclose(found.frequency[:6], [0.0, 0.0, 1.0, 1.0, 1.0, found.frequency[5]], atol=1e-7)
    assert np.all(found.damping_ratio == 0.0)
    pendulum = System(gravity=(0.0, 0.0, -9.81))
    pendulum.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.1), position=(0.35, 0.0, -0.35)), "bob")
    pendulum.add(parts.Joint(a=(0.0, 0.0, 0.0), b="bob", type="revolute", axis=(0.0, 1.0, 0.0)), "pin")
    found = pendulum.modes()
    rows = {row[0]: row[1:] for table in found.answer().of_kind(Table) for row in table.rows}
    assert [text != "0" for text in rows["sum"]] == [True, False, False, False, True, False]


def test_an_equilibrium_that_falls_has_a_growing_mode():
    """A pendulum on its head: s = sqrt(m g l/I), and its effective masses are there."""
    system = System(gravity=(0.0, -9.81, 0.0))
    system.add(parts.RigidBody(mass=2.0, inertia=(0.1, 0.1, 0.1), points={"pin": (0.0, -0.5, 0.0)}), "bob")
    system.add(parts.Joint(a=(0.0, -0.5, 0.0), b="bob.pin", type="revolute", axis=(0.0, 0.0, 1.0)), "hinge")
    found = system.modes(count=1)
    rate = np.sqrt(2.0 * 9.81 * 0.5 / (0.1 + 2.0 * 0.25))
    assert_allclose(found.pole, [rate], rtol=1e-9)
    assert f"1 mode grows (real part of the pole above 0): mode 0 by {rate:.4g} 1/s without oscillation" in str(found)
    assert "mass x, kg" in str(found)


# ------------------------------------------------------------------------------------------------ shapes


def test_maps_of_places_are_those_of_a_rigid_motion(rng):
    """Against finite motions of the state by rotation matrices."""
    a = mixed().assemble()
    y, point = a.y.copy(), np.array([0.4, 0.1, -0.3])
    known, r = linearized_points(a, y), rigid_motions(a, y, point)
    assert list(known) == [
        *("hub", "wheel", "mass"), *(f"cable[{i}]" for i in range(3)), "cable.root", "cable.tip",
        *(f"rib[{i}]" for i in range(3)), "rib.root", "rib.tip",
    ]  # fmt: skip
    modes(a, count=1)  # loads `displace`
    for _ in range(3):
        shift, turn = rng.standard_normal(3), rng.standard_normal(3)
        u = r @ np.concatenate([shift, turn])
        angle = 1e-6 * np.linalg.norm(turn)
        R = rotation([np.cos(0.5 * angle), *(np.sin(0.5 * angle) * turn / np.linalg.norm(turn))])
        moved = y.copy()
        displace(y, 1e-6 * u, False, a.model, moved)
        for name, place in known.items():
            if place.displacement is not None:
                wanted = R @ (place.position - point) + point + 1e-6 * shift
                assert_allclose(linearized_points(a, moved)[name].position, wanted, atol=1e-11)
                assert_allclose(place.displacement @ u[place.where], shift + np.cross(turn, place.position - point))
            if name == "wheel":
                assert_allclose(place.rotation @ u[place.where], np.array([0.0, 0.6, 0.8]) * (turn @ [0.0, 0.6, 0.8]))
            elif name.startswith("cable"):
                axis = np.array([0.6, 0.8, 0.0])
                assert_allclose(place.rotation @ u[place.where], turn - axis * (axis @ turn), atol=1e-12)
            elif place.rotation is not None:
                assert_allclose(place.rotation @ u[place.where], turn, atol=1e-12)
        Q, old = np.empty((3, 3)), np.empty((3, 3))
        rotation_from_quaternion(*moved[3:7], Q)
        rotation_from_quaternion(*y[3:7], old)
        assert_allclose(Q, R @ old, atol=1e-11)


def test_shapes_of_parts():
    found = modes(mixed().assemble(), count=20)
    assert found.parts == ("hub", "wheel", "mass", "cable", "rib")
    assert "rib" in found
    assert "rib.tip" in found
    assert "spring" not in found
    assert found["hub"].shape.shape == (20, 6)
    assert found["wheel"].shape.shape == (20, 1)
    assert found["cable"].shape.shape == (20, 3, 2, 3)
    assert found["rib"].shape.shape == (20, 3, 4, 3)
    assert_allclose(found["rib"].displacement, found["rib"].shape[:, :, 0])
    assert_allclose(found["rib.tip"].rotation, found["rib"].rotation[:, -1])
    assert_allclose(found["cable[1]"].shape, found["cable"].shape[:, 1])
    assert_allclose(found["wheel"].displacement, 0.0)
    with pytest.raises(InputError, match="'mass' is a point, which has no rotation"):
        _ = found["mass"].rotation


def test_the_tip_of_a_cantilever_turns_by_its_slope():
    for formulation in ("cable", "assumed_strain"):
        found = modes(beam(formulation, 24, section=BAR), count=1)["beam"]
        # 1.37650 w/L at the tip in the first mode of a clamped beam
        ratio = found.rotation[0, -1, 2] / found.displacement[0, -1, 1]
        assert ratio == pytest.approx(1.376506, rel=2e-3)


# ------------------------------------------------------------------------------------------------ to see


def test_states_of_a_mode_keep_the_energy():
    """Kinetic and elastic energy of the displaced states, by the nonlinear model, sum to 1/2 (w c)^2."""
    system = System()
    soft, section = Material(young_modulus=1e8, poisson_ratio=0.3, density=1e3), Rectangle(thickness=0.05, width=0.06)
    boom = parts.Beam(length=1.0, section=section, elements=4, material=soft, formulation="assumed_strain")
    system.add(boom, "boom")
    system.add(parts.RigidBody(mass=0.1, inertia=(2e-3, 3e-3, 4e-3), position=(1.1, 0.0, 0.0)), "bob")
    system.add(parts.Joint(a=(0.0, 0.0, 0.0), b="boom.root", type="clamp"))
    system.add(parts.Joint(a=("bob", (-0.1, 0.0, 0.0)), b="boom.tip", type="clamp"))
    a = system.assemble()
    found = modes(a, count=6)
    for k in (0, 5):
        t, y = found.states(k, amplitude=1e-4, frames=25)
        assert t[-1] == pytest.approx(1.0 / found.frequency_hz[k])
        assert y.shape == (25, a.y.size)
        assert_allclose(y[0], y[-1], atol=1e-9)
        sums = sums_of(a.model, t, y, np.tile(a.s, (25, 1)))
        energy = sums[:, mdl.KINETIC] + sums[:, mdl.ELASTIC]
        still = sums_of(a.model, t[:1], found.equilibrium.y[-1:], a.s[None])[0, mdl.ELASTIC]
        largest = max(np.linalg.norm(found[name].displacement[k].reshape(-1, 3), axis=1).max() for name in found.parts)
        assert np.ptp(sums[:, mdl.KINETIC]) > 0.5 * (energy.mean() - still)
        assert_allclose(energy - still, 0.5 * (found.frequency[k] * 1e-4 / largest) ** 2, rtol=5e-3)


def test_states_without_amplitude_can_be_seen():
    a = beam("cable", 8, section=BAR)
    found = modes(a, count=2)
    n_q = int(a.model.info.nq)
    _, y = found.states(0)
    tip = y[:, n_q - 6 : n_q - 3] - found.equilibrium.y[-1, n_q - 6 : n_q - 3]
    assert np.linalg.norm(tip, axis=1).max() == pytest.approx(0.1, rel=1e-9)
    free = modes(beam("cable", 8, (), section=BAR), count=5)
    t, y = free.states(0, amplitude=0.2, frames=41)
    assert t[-1] == 1.0
    assert np.ptp(y[:, 0]) == pytest.approx(0.4, rel=1e-6)
    wheel = System()
    wheel.add(parts.RigidBody(motion="spin", inertia=2.0), "wheel")
    t, y = modes(wheel.assemble()).states(0, frames=41)
    assert np.abs(y[:, 0]).max() == pytest.approx(0.3)
    spinning = modes(a, rotating=(0.0, 0.0, 2.0), count=1)
    t, y = spinning.states(0, amplitude=1e-3)
    assert np.all(np.isfinite(y))
    assert t[-1] == pytest.approx(2.0 * np.pi / spinning.frequency[0])
    for bad, message in (
        ({"k": 2}, "k is 2; it must be the number of a mode, from 0 to 1"),
        ({"k": 0, "frames": 1}, "frames is 1"),
        ({"k": 0, "amplitude": 0.0}, "amplitude is 0.0"),
    ):
        with pytest.raises(InputError, match=message):
            found.states(**bad)


@pytest.mark.slow
def test_dataset_and_table(tmp_path):
    found = modes(mixed().assemble(), count=9)
    seen = found.to_dataset()
    assert seen["frequency_hz"].attrs["units"] == "Hz"
    assert seen["effective_inertia"].attrs["units"] == "kg m2"
    assert_allclose(seen["rib.rotation"], found["rib"].rotation)
    assert_allclose(seen["effective_mass"].sel(axis="y"), found.effective_mass[:, 1])
    assert_allclose(seen["participation_mass"] ** 2, seen["effective_mass"])
    assert_allclose(seen["participation_inertia"].sel(axis="z"), found.participation[:, 5])
    assert seen["participation_inertia"].attrs["units"] == "kg m"
    assert "mass.rotation" not in seen
    seen.to_netcdf(tmp_path / "modes.nc", engine="h5netcdf")
    modal, sums = ModalResults.of(found).answer().of_kind(Table)
    assert len(modal.rows) == 9
    assert [row[0] for row in sums.rows] == ["sum", "all modes", "held by supports", "whole structure"]
    assert "inertia z, kg m²" in modal.heads
