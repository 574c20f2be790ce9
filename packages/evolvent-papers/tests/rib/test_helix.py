"""A rib wound as a helix: its shape, the forces that hold it, its winding and its release."""

from __future__ import annotations

import functools
import math

import numpy as np
import pytest

import evolvent
from evolvent import System, cases, closed_forms, parts, results
from evolvent.elements import (
    Material,
    Rectangle,
    axis_shape,
    beam_form,
    cable_form,
    coil,
    helix,
    helix_stiffness_ratio,
)
from evolvent_base.errors import InputError
from evolvent_papers.wrapped_rib import structure
from evolvent_papers.wrapped_rib.case_checks import warnings
from evolvent_papers.wrapped_rib.initial_state import initial_state
from rib.reading import balance, case_of, elastic, over_ribs, stored

RADIUS, LENGTH = 0.6, 12.0
STRIP = (Rectangle(thickness=3e-4, width=0.03), Material(young_modulus=5e6, poisson_ratio=0.3, density=1600.0))
FREE = {"hub.motion": "free", "hub.mass": 20, "hub.inertia": 5}


def curvature(nodes: np.ndarray, length: float) -> np.ndarray:
    """Curvature at the two points of Gauss's rule of every element, 1/m."""
    ends = np.stack([nodes[:-1, 0], nodes[:-1, 1], nodes[1:, 0], nodes[1:, 1]], axis=1)
    xi = 0.5 + 0.5 * np.array([-1.0, 1.0]) / math.sqrt(3.0)
    slope, bend = (np.einsum("jk,nji->nki", axis_shape(length, xi, order=order), ends) for order in (1, 2))
    size = np.linalg.norm(slope, axis=-1)
    return np.linalg.norm(np.cross(slope, bend), axis=-1) / size**3


# ------------------------------------------------------------------------------------------------ shape


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formulation", "pitch"), [("cable", 0.05), ("cable", 0.6), ("cable_stretch", 0.6), ("assumed_strain", 0.6)]
)
def test_a_wound_rib_is_a_helix_without_stretch(book, formulation, pitch):
    """Height p/(2 pi) of the angle, length sqrt(R^2 + (p/2 pi)^2) of it, curvature cos^2(a)/R."""
    count = 80
    nodes = helix(formulation, count, LENGTH / count, *STRIP, radius=RADIUS, pitch=pitch, points=4)
    x, angle = nodes[:, 0], math.atan(pitch / (2.0 * math.pi * RADIUS))
    phi = np.unwrap(np.arctan2(x[:, 1], x[:, 0]))
    assert nodes[0, 0, 1:] == pytest.approx([0.0, 0.0], abs=1e-15)
    assert x[:, 2] == pytest.approx(pitch * phi / (2.0 * math.pi), rel=1e-12)
    assert np.hypot(x[:, 0], x[:, 1]) == pytest.approx(RADIUS, rel=1e-4)
    assert phi[-1] == pytest.approx(LENGTH * math.cos(angle) / RADIUS, rel=2e-4)
    assert x[-1, 2] == pytest.approx(LENGTH * math.sin(angle), rel=2e-4)
    bent = curvature(nodes, LENGTH / count)
    assert bent == pytest.approx(math.cos(angle) ** 2 / RADIUS, rel=2e-3)
    if nodes.shape[1] == 4:  # the flat side lies on the hub
        out = np.stack([np.cos(phi), np.sin(phi), 0.0 * phi], axis=1)
        assert np.einsum("ni,ni->n", nodes[:, 2], -out) == pytest.approx(np.linalg.norm(nodes[:, 2], axis=1), rel=1e-9)
        lean = np.arctan2(-np.einsum("ni,ni->n", nodes[:, 3], np.cross([0, 0, 1], out)), nodes[:, 3, 2])
        assert lean == pytest.approx(angle, rel=0.03)
    book(
        "Wrapped rib", f"Helix, pitch {pitch} m [{formulation}, 80 elements]: curvature", reference="cos^2(a)/R",
        source="closed form", error=float(np.abs(bent * RADIUS / math.cos(angle) ** 2 - 1.0).max()), allowed=2e-3,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("formulation", "counts"), [("cable", (40, 80)), ("assumed_strain", (160, 320))])
def test_a_strip_on_a_helix_has_the_energy_of_its_torsion_too(formulation, counts):
    """G J t^2/2 with the torsion t = sin(a) cos(a)/R beside E I k^2/2; errors of the elements fall with l^2."""
    coarse, fine = (helix_stiffness_ratio(formulation, LENGTH / n, *STRIP, RADIUS, 0.6) for n in counts)
    assert fine - (coarse - fine) / 3.0 == pytest.approx(1.0, abs=1e-3)
    nodes = helix(formulation, 1, LENGTH / counts[1], *STRIP, radius=RADIUS, pitch=0.6)
    form = cable_form if formulation == "cable" else functools.partial(beam_form, formulation)
    angle = math.atan(0.6 / (2.0 * math.pi * RADIUS))
    torsion = 0.0 if formulation == "cable" else 2.0 * math.tan(angle) ** 2 / 1.3  # of a thin strip, over bending
    closed = 0.5 * 3.375e-7 * math.cos(angle) ** 4 / RADIUS**2 * (1.0 + torsion) * LENGTH / counts[1]
    assert form(LENGTH / counts[1], *STRIP).energy(nodes.ravel()) == pytest.approx(closed * fine, rel=0.01)


def test_elements_that_are_too_stiff_on_a_helix_are_warned_of():
    changes = {"rib.pitch": 0.6, "rib.formulation": "assumed_strain"}
    assert "times as stiff as the rib" in " ".join(warnings(cases.load("wrapped-rib-deploy", changes)))
    assert warnings(cases.load("wrapped-rib-deploy", {"rib.pitch": 0.6})) == []


def test_a_helix_of_a_small_pitch_is_a_coil():
    mesh = ("assumed_strain", 40, 0.3, *STRIP)
    flat, low = coil(*mesh, radius=RADIUS, points=4), helix(*mesh, radius=RADIUS, pitch=1e-6, points=4)
    assert low == pytest.approx(flat, abs=1e-5)


@pytest.mark.slow
def test_a_helix_lies_about_the_middle_of_the_hub_or_where_its_root_stands():
    case = cases.load("wrapped-rib-deploy", {"rib.pitch": "0.2 m", "rib.count": 3})
    nodes = initial_state(case).nodes
    assert nodes[:, 0, 0, 2] == pytest.approx(-0.5 * case.rise)
    assert nodes[:, -1, 0, 2] == pytest.approx(0.5 * case.rise, rel=1e-3)
    case = cases.load("wrapped-rib", {"rib.pitch": "0.2 m", "rib.root_height": "-1 m"})
    (straight,) = initial_state(case).nodes
    assert straight[0, 0] == pytest.approx([0.6, 0.0, -1.0])
    assert straight[-1, 0, 2] + 1.0 == pytest.approx(case.rise)
    assert np.linalg.norm(straight[-1, 0] - straight[0, 0]) == pytest.approx(LENGTH)


@pytest.mark.parametrize(
    ("base", "changes", "words"),
    [
        ("wrapped-rib-deploy", {"rib.pitch": "1 m"}, ["rib.pitch is 1 m", "hub.height is 3 m", "it must be 0.9633"]),
        ("wrapped-rib-deploy", {"rib.pitch": 0.1, "rib.root_height": 1.3}, ["rib.root_height is 1.3 m", "to 1.167 m"]),
        ("wrapped-rib-deploy", {"rib.root_height": -1.6}, ["rib.root_height is -1.6 m", "from -1.485 to 1.485 m"]),
        ("wrapped-rib-deploy", {"rib.pitch": 0.02, "contact.self": True}, ["rib.pitch is 0.02 m", "contact.self"]),
        ("wrapped-rib-deploy", {"rib.pitch": -0.1}, ["rib.pitch is -0.1"]),
        (
            "wrapped-rib",
            {"rib.pitch": 0.1, "drive": {"kind": "hub", "rate": 0.1}, "hub.motion": "driven"},
            ["drive.torque is missing", "rib.pitch"],
        ),
        (
            "wrapped-rib",
            {"rib.pitch": 0.1, "drive": {"kind": "hub", "rate": 0.1, "torque": 0.1}, "hub.motion": "driven"}
            | {"damping.elements": "first"},
            ["damping.elements is given", "rib.pitch"],
        ),
    ],
)
def test_helices_that_are_refused(base, changes, words):
    with pytest.raises(InputError) as caught:
        cases.load(base, changes)
    assert all(word in str(caught.value) for word in words), str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_largest_pitch_takes_all_of_the_hub():
    with pytest.raises(InputError) as caught:
        cases.load("wrapped-rib-deploy", {"rib.pitch": 1})
    most = float(str(caught.value).split("it must be ")[1].split(" m")[0])
    case = cases.load("wrapped-rib-deploy", {"rib.pitch": most * (1.0 - 1e-4)})
    assert case.rise + 0.03 * math.cos(case.helix_angle) == pytest.approx(3.0, rel=1e-3)


def test_turns_that_overlap_are_warned_of():
    assert "turns overlap" in " ".join(warnings(cases.load("wrapped-rib-deploy", {"rib.pitch": "2 cm"})))
    assert warnings(cases.load("wrapped-rib-deploy", {"rib.pitch": "3 cm"})) == []
    assert "turns overlap" in " ".join(warnings(cases.load("wrapped-rib-deploy", {"rib.pitch": 0.05, "rib.count": 2})))


# ------------------------------------------------------------------------------------------------ loads


def test_a_torque_along_a_screw_pushes_a_rod_along_its_axis():
    """The force along the axis is T b M/J, b = pitch/2 pi; the torque stays T."""
    pitch, system = 0.5, System()
    rod = parts.Beam(
        length=1.0, section=Rectangle(thickness=0.02, width=0.05), formulation="cable", elements=2,
        material=Material(young_modulus=1e10, poisson_ratio=0.0, density=1000.0), position=(-0.5, 0.0, 0.0),
    )  # fmt: skip
    system.add(rod, "rod")
    system.add(parts.Load(along="rod", torque=(0.0, 0.0, 0.01), pitch=pitch), "motor")
    run = system.simulate(until="1 s", every=0.1)
    mass, inertia, b = 1.0, 1.0 / 12.0, pitch / (2.0 * math.pi)
    force = 0.01 * b * mass / inertia
    assert run["rod"]["position"].values[-1, 1, 2] == pytest.approx(0.5 * force / mass, rel=1e-4)
    assert run["momentum"].values[-1, 2] == pytest.approx(force, rel=1e-4)
    assert run["angular_momentum"].values[-1, 2] == pytest.approx(0.01, rel=1e-4)
    assert run["motor"]["work"].values[-1] == pytest.approx(run["work_loads"].values[-1], rel=1e-3)


# ------------------------------------------------------------------------------------------------ holding


@pytest.mark.slow
@pytest.mark.parametrize(("pitch", "formulation"), [(0.1, "cable"), (0.6, "cable"), (0.6, "assumed_strain")])
def test_a_helix_is_held_by_its_closed_form(book, pitch, formulation):
    """Sum of the contact forces T L cos(a)/(2 R^2), tension T (1 - s/L)/(R cos(a)), and the height of the helix."""
    changes = {"rib.pitch": pitch, "rib.formulation": formulation, "rib.elements": 40, "hold.time": 15}
    run = evolvent.run("wrapped-rib-hold", changes)
    case = case_of(run)
    cosine = math.cos(case.helix_angle)
    closed = 0.2 * LENGTH * cosine / (2.0 * RADIUS**2)
    force = float(run["contact-1"]["normal_force"][-1])
    assert closed_forms.wound_contact_force(case.strip, 0.2) == pytest.approx(closed, rel=1e-9)
    assert force == pytest.approx(closed, rel=4e-3)
    book(
        "Wrapped rib", f"Helix held, pitch {pitch} m [{formulation}, 40 elements]: contact force",
        reference="T L cos(a)/2 R^2", source="closed form", error=abs(force / closed - 1.0), allowed=4e-3,
    )  # fmt: skip
    z = run["rib-1"]["position"].values[-1, :, 2]
    stretch = 0.2 / (2.0 * RADIUS * cosine * 45.0)  # mean strain, N/EA
    assert z[-1] - z[0] == pytest.approx(case.rise * (1.0 + stretch), rel=6e-3)
    assert np.diff(z)[3:-3] == pytest.approx(case.rise / 40, rel=0.02)
    arc, pull = run["rib-1"]["arc"].values, run["rib-1"]["axial_force"].values[-1]
    inner = (arc > 1.0) & (arc < 11.0)
    assert pull[inner] == pytest.approx(0.2 / (RADIUS * cosine) * (1.0 - arc[inner] / LENGTH), rel=0.02, abs=5e-3)
    assert float(run.hub_torque[-1]) == pytest.approx(0.2, rel=2e-3)
    assert abs(balance(run)).max() < 2e-3


@pytest.mark.slow
def test_a_torque_about_the_axis_alone_pulls_a_helix_into_the_plane(monkeypatch):
    """Nothing holds the height of the free tip: without friction the tension has no part along the axis."""
    monkeypatch.setattr(structure, "_pitch", lambda case: 0.0)
    changes = {"rib.pitch": 0.2, "rib.elements": 16, "hold.time": 30, "drive.ramp": 1}
    run = evolvent.run("wrapped-rib-hold", changes)
    z = run["rib-1"]["position"].values[:, :, 2]
    assert abs(z[-1, -1] - z[-1, 0]) < 0.2 * (z[0, -1] - z[0, 0])


@pytest.mark.slow
def test_turns_beside_one_another_do_not_press_on_one_another():
    changes = {"rib.pitch": 0.06, "contact.self": True, "rib.elements": 30, "hold.time": 0.2, "drive.ramp": 0.1}
    run = evolvent.run("wrapped-rib-hold", changes)
    assert run.attrs["status"] == "success"
    assert np.all(run["layer-1"]["normal_force"].values == 0.0)


# ------------------------------------------------------------------------------------------------ winding


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pitch", "changes"),
    [
        (
            0.6,
            {"drive": {"kind": "torque", "torque": 0.2}, "solver.duration": 110}
            | {"rib.length": 12, "rib.elements": 30},
        ),
        pytest.param(0.1, {"drive": {"kind": "tip", "rate": 0.5, "ramp": 2}}, marks=pytest.mark.release),
        (0.6, {"drive": {"kind": "tip", "rate": 0.5, "ramp": 2}}),
        (0.1, {"drive": {"kind": "hub", "rate": 0.2, "torque": 0.1}, "hub.motion": "driven", "solver.duration": 100}),
    ],
    ids=["torque", "tip", "tip, steep", "hub"],
)
def test_a_rib_winds_as_a_helix(pitch, changes):
    short = {"rib.pitch": pitch, "rib.length": 8, "rib.elements": 20, "output.every": 1}
    run = evolvent.run("wrapped-rib", short | changes)
    case = case_of(run)
    assert run.attrs["status"] == "success"
    assert float(run.wrap_angle[-1, 0]) * RADIUS / case.strip.length == pytest.approx(1.0, abs=5e-3)
    z = run["rib-1"]["position"].values[-1, :, 2]
    assert z[-1] - z[0] == pytest.approx(case.rise, rel=0.01)
    assert np.diff(z)[2:-2] == pytest.approx(case.rise / case.rib.elements, rel=0.08)
    turn = 2.0 * math.pi * RADIUS / math.cos(case.helix_angle)
    arc = run["rib-1"]["arc_node"].values
    assert np.interp(arc[0] + turn, arc, z) - z[0] == pytest.approx(pitch, rel=0.02)
    assert abs(balance(run)).max() < 0.03


# ------------------------------------------------------------------------------------------------ deployment


@pytest.mark.slow
def test_a_helix_springs_open_as_a_plane_coil_of_the_same_energy(book):
    """To the first order in the pitch the tip follows the closed form of the rib as seen along the hub's axis."""
    runs = [evolvent.run("wrapped-rib-deploy", {"solver.duration": 150, "rib.pitch": p}) for p in (0.0, 0.05)]
    tips = [float(run.tip_radius[-1, 0]) for run in runs]
    assert tips[1] == pytest.approx(tips[0], rel=1e-3)
    case = case_of(runs[1])
    energy = closed_forms.bending_energy(case.strip)
    assert energy == pytest.approx(0.5 * 3.375e-7 * LENGTH * math.cos(case.helix_angle) ** 4 / RADIUS**2, rel=1e-9)
    assert stored(runs[1], "bending")[0] == pytest.approx(energy, rel=1e-3)
    assert elastic(runs[1])[-1] < elastic(runs[1])[0]
    assert abs(balance(runs[1])).max() < 4e-3
    closed = float(closed_forms.deployed_tip_radius(case.strip, 150.0))
    book(
        "Wrapped rib", "Helix, pitch 0.05 m: radius of the tip at 150 s of its deployment", source="closed form",
        reference="sqrt(R^2 + 2 v R t)", error=abs(tips[1] / closed - 1.0), allowed=0.01,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {"rib.formulation": "assumed_strain", "rib.elements": 30},
        {"solver.method": "generalized-alpha"},
        {"rib.root": "clamp"},
        {"hub.motion": "spin", "hub.density": 10},
    ],
)
def test_every_kind_of_helix_is_released(changes):
    run = evolvent.run("wrapped-rib-deploy", {"rib.pitch": 0.4, "rib.elements": 20, "solver.duration": 15} | changes)
    assert run.attrs["status"] == "success"
    assert float(run.wrap_angle[-1, 0]) < float(run.wrap_angle[0, 0]) - 0.5
    assert -0.03 < balance(run).min() < balance(run).max() < 1e-3  # numerical damping


def test_helices_on_a_free_hub_keep_the_momenta():
    run = evolvent.run(
        "wrapped-rib-deploy", FREE | {"rib.count": 2, "rib.pitch": 0.4, "rib.elements": 20, "solver.duration": 10}
    )
    scale = 10.0 * float(np.abs(run.hub_torque).max())
    assert np.abs(run.angular_momentum.values).max() < 1e-9 * max(scale, 1.0)
    assert np.abs(run.momentum.values).max() < 1e-9


@pytest.mark.slow
def test_a_run_goes_on_from_a_helix(tmp_path):
    held = evolvent.run("wrapped-rib-hold", {"rib.pitch": 0.4, "rib.elements": 20, "hold.time": 2, "drive.ramp": 1})
    path = str(tmp_path / "held.nc")
    results.save(held, path)
    on = {"start": path, "rib.pitch": 0.4, "rib.elements": 20, "solver.duration": 1}
    run = evolvent.run("wrapped-rib-deploy", on)
    assert run["rib-1"]["position"].values[0] == pytest.approx(held["rib-1"]["position"].values[-1], abs=1e-9)
    with pytest.raises(InputError, match=r"rib.pitch is 0, but the run .* has 0.4"):
        evolvent.run("wrapped-rib-deploy", on | {"rib.pitch": 0})
    assert over_ribs(run, "rib-{}.tip_speed").shape[1] == 1
