"""What a new user meets first: cases without a system, units of gravity, messages, files of packages not installed."""

from __future__ import annotations

import json
import pathlib
import subprocess
import sys

import numpy as np
import pytest
import xarray as xr

import evolvent as ev
from evolvent import cases, parts
from evolvent.design import studies
from evolvent.design.studies import draw
from evolvent.view import show
from evolvent_base.errors import InputError

FALL = {
    "gravity": [0, 0, "-9.81 m/s^2"],
    "parts": {"ball": {"kind": "point", "mass": "1 kg"}},
    "simulate": {"until": 1},
}


def ball() -> ev.System:
    system = ev.System(gravity=(0, 0, "-9.81 m/s^2"))
    system.add(parts.Point(mass=1.0), "ball")
    return system


def test_a_case_of_parts_needs_no_system() -> None:
    """Parts alone are a structure: for `load`, for checks field by field, and in a study."""
    case = cases.load(FALL)
    assert case.system == "structure"
    assert cases.load(FALL, {"parts.ball.mass": "2 kg"}).parts["ball"].mass == 2.0
    assert cases.problems(FALL) == {}
    assert list(cases.problems(FALL | {"simulate": {"until": -1}})) == ["simulate.until"]
    study = {"case": FALL, "over": {"parts.ball.mass": ["1 kg", "2 kg"]}, "keep": ["ball.position.z.last"]}
    assert studies.read(study).count == 2
    with pytest.raises(InputError, match="the key 'system' is missing"):
        cases.load({"simulate": {"until": 1}})


def test_gravity_takes_a_unit() -> None:
    for gravity in [(0, 0, -9.81), (0, 0, "-9.81 m/s^2"), [0, 0, "-981 cm/s^2"], np.array([0.0, 0.0, -9.81])]:
        system = ev.System(gravity=gravity)
        system.add(parts.Point(mass=1.0), "ball")
        assert system.simulate(until=1.0)["ball"].position.values[-1] == pytest.approx([0.0, 0.0, -4.905])
    for wrong in (9.81, (0, 0), (0, 0, float("nan")), (0, 0, "9.81 m")):
        with pytest.raises(InputError, match=r"^gravity is .* a list of 3 values, such as \[0, 0, 1 m/s\^2\]"):
            ev.System(gravity=wrong)  # type: ignore[arg-type]


def test_no_parts_are_refused() -> None:
    for analyse in (lambda s: s.simulate(until=1), lambda s: s.equilibrium(), lambda s: s.modes()):
        with pytest.raises(InputError, match="the system has no parts; add one"):
            analyse(ev.System())


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (
            parts.Load(at="tether", force=(1, 0, 0)),
            "'tether' is a thread; give 'tether.tip', or a node from its tip on, 'tether.0.' to 'tether.3.'",
        ),
        (parts.Load(at="reel", force=(1, 0, 0)), "'reel' is a Reel, not a body, point or beam$"),
        (parts.Load(at="hub.antenna", force=(1, 0, 0)), "'hub' has no point 'antenna'; its key `points` names none$"),
        (
            parts.Load(at="hbu", force=(1, 0, 0)),
            "'push' refers to 'hbu', but no part is called that; did you mean 'hub'",
        ),
    ],
)
def test_what_nothing_can_be_attached_to(part: parts.Load, message: str) -> None:
    system = ev.System()
    system.add(parts.RigidBody(mass=1.0, inertia=1.0), "hub")
    system.add(parts.Reel(body="hub", radius=0.1, drive=parts.ConstantDrive(rate=1.0)), "reel")
    system.add(parts.Thread(reel="reel", length=1.0, line_density=1e-3, nodes=4), "tether")
    system.add(part, "push")
    with pytest.raises(InputError, match=message):
        system.assemble()


def test_names_of_the_variables_of_a_run_are_refused() -> None:
    """Every variable and dimension beside the groups of parts: a part of that name could not be kept in the results."""
    run = ball().simulate(until=1.0)
    for name in {*run.to_dataset().variables, *run.dims}:
        with pytest.raises(InputError, match=f"the name of a part is '{name}', which is a result of the whole run"):
            ball().add(parts.Point(mass=1.0), name)
    with pytest.raises(InputError, match="parts: the name of a part is 'energy', which is a result of the whole run"):
        cases.load({"parts": {"energy": {"kind": "point", "mass": 1}}})


def test_a_single_sample_is_a_mark() -> None:
    rest = ev.load("boom-slew").equilibrium()
    assert [line.marker for line in show.figure(rest, ["hub.rate"]).panels[0].lines] == ["o"] * 3


@pytest.mark.slow
def test_an_equilibrium_is_shown(call, tmp_path) -> None:
    """A page of one frame, which does not play; the command writes it, and results never over the case."""
    (tmp_path / "boom.yaml").write_text(cases.text("boom-slew"))
    for words in (["equilibrium"], ["modes", "--count", "3"]):
        code, _, err = call(words[0], "boom.yaml", *words[1:], "-o", "boom.yaml")
        assert (code, err) == (2, "evolvent: -o 'boom.yaml' is the case file itself; name another, such as 'run.nc'\n")
    code, out, err = call("equilibrium", "boom.yaml", "--figures", "rest", "-o", "rest.nc")
    assert (code, err) == (0, "")
    assert out.splitlines()[-1] == "figures: along-boom.png, shape.html in rest"
    page = (tmp_path / "rest" / "shape.html").read_text(encoding="utf-8")
    assert '"playing":false' in page.replace(" ", "")
    rest = ev.open(tmp_path / "rest.nc")
    assert rest.sizes["time"] == 1
    assert rest.ev.animate(tmp_path / "rest.html") == str(tmp_path / "rest.html")


@pytest.mark.slow
def test_a_file_of_modes_is_no_run(tmp_path) -> None:
    ev.load("boom-slew").modes(count=2).save(tmp_path / "modes.nc")
    with pytest.raises(InputError, match=r"it holds modes, not a run; xarray\.open_dataset reads them"):
        ev.open(tmp_path / "modes.nc")
    assert xr.open_dataset(tmp_path / "modes.nc", engine="h5netcdf").frequency_hz.size == 2


def test_a_file_written_from_a_case_keeps_its_sections() -> None:
    case = FALL | {"modes": {"count": 3}, "equilibrium": {"time": "2 s"}}
    text = ev.load(case).copy().to_yaml()
    again = cases.load(cases.parse_yaml(text, "text"))
    assert (again.modes.count, again.equilibrium.time) == (3, 2.0)
    assert ev.load(cases.parse_yaml(text, "text")).to_yaml() == text
    assert "modes" not in ball().to_yaml()


def test_values_and_units_stay_on_one_line() -> None:
    """A part with many keys is written a key a line, not on one that is broken between a number and its unit."""
    system = ev.System()
    for name in ("a", "b"):
        system.add(parts.RigidBody(mass=1.0, inertia=1.0), name)
    hinge = parts.JointSpring(
        a="a", b="b", axis=(0, 0, 1), stiffness=0.1, damping=0.05, rest=0.1, latch=0.0, latch_stiffness=1e3,
        latch_damping=20.0
    )  # fmt: skip
    system.add(hinge, "hinge")
    text = system.to_yaml()
    assert "    damping: 0.05 N m s/rad\n" in text
    assert cases.load(cases.parse_yaml(text, "text")).parts["hinge"] == hinge


def test_an_animation_is_a_page(tmp_path) -> None:
    run = ball().simulate(until=1.0)
    with pytest.raises(InputError, match=r"an animation is a page, whose file ends with .html; `evolvent export"):
        run.ev.animate(tmp_path / "fall.gif")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("missing", ["system", "part"])
def test_a_run_of_a_package_that_is_not_installed(tmp_path, missing: str) -> None:
    """Its file opens with all its data, and is shown as any structure is."""
    run = ball().simulate(until=1.0)
    if missing == "system":
        run.attrs |= {"system": "umbrella", "case": "system: umbrella\nribs: 8\n"}
    else:
        run.attrs["case"] = run.attrs["case"].replace("kind: point", "kind: umbrella-rib")
    ev.save(run, tmp_path / "run.nc")
    back = ev.open(tmp_path / "run.nc")
    assert back["ball"].position.values[-1, 2] == pytest.approx(-4.905)
    assert [figure.name for figure in cases.presenter(back).figures(back)] == ["point", "energy-balance"]
    assert back.ev.table()
    assert back.ev.motion() is not None
    # what is damaged is refused all the same
    run.attrs["case"] = "system: structure\nparts: {}\nsimulat: {}\n"
    ev.save(run, tmp_path / "run.nc")
    with pytest.raises(InputError, match="no whole run of evolvent"):
        ev.open(tmp_path / "run.nc")
    assert json.loads(run.attrs["statistics"])["steps"] > 0


# ------------------------------------------------------------------------------------------------ pictures


def solids(case: dict, name: str) -> list:
    """What a body of a case is drawn as, at the start."""
    motion = ev.load(case).simulate(until=1e-3, every=1e-3).ev.motion()
    return next(list(frame.solids) for frame in motion.frames if frame.name == name)


def without_shapes(name: str) -> dict:
    case = cases.content_of(name)
    for part in case["parts"].values():
        part.pop("shape", None)
    return case


def test_bars_of_a_mechanism_end_at_its_joints() -> None:
    """Bodies of the Andrews mechanism without shapes: a bar, and a triangle whose third corner is the spring's end."""
    case = without_shapes("andrews-mechanism")
    (bar,) = solids(case, "K2")
    assert bar.profile[1][0] - bar.profile[0][0] == pytest.approx(28e-3)
    assert bar.centre == pytest.approx((-2.5e-3, 0.0, 0.0))
    sides = [solid.profile[1][0] - solid.profile[0][0] for solid in solids(case, "K3")]
    assert sides == pytest.approx([35e-3, np.hypot(20e-3, 17e-3), np.hypot(20e-3, 18e-3)])
    # a body whose moments of inertia tell its shape is a box all the same
    case["parts"]["K2"]["inertia"] = [1e-7, 2e-7, 2.5e-7]
    (box,) = solids(case, "K2")
    edges = np.array(box.edges)
    assert 0.00365 / 12.0 * (edges[1] ** 2 + edges[2] ** 2) == pytest.approx(1e-7)


def test_a_spinning_body_without_mass_reaches_its_drum() -> None:
    (disc,) = solids(without_shapes("yo-yo-despin"), "body")
    assert disc.size == pytest.approx(np.hypot(1.5, 0.3))
    assert disc.axis == pytest.approx((0.0, 0.0, 1.0))


def test_numbers_beside_the_picture_are_of_the_hinges_first() -> None:
    run = ev.load("solar-array").simulate(until=0.1, every=0.1)
    names = [name.partition(" [")[0] for name in run.ev.motion().numbers]
    assert names == ["hinge 1.angle", "hinge 1.torque", "hinge 2.angle", "hinge 3.angle"]


def test_a_taut_wire_shows_its_force_and_a_bent_beam_its_curvature() -> None:
    wire = ev.load("spinning-tether").simulate(until=1.0).ev.motion()
    assert next(iter(wire.lines[0].values)) == "axial force [N]"
    boom = ev.load("boom-slew").simulate(until=1.0).ev.motion()
    assert next(iter(boom.lines[0].values)) == "curvature [m-1]"


def test_the_end_mass_of_a_thread_is_marked() -> None:
    system = ev.System()
    system.add(parts.RigidBody(mass=100.0, inertia=20.0, angular_velocity=(0, 0, 1)), "hub")
    system.add(parts.Reel(body="hub", radius=0.1, drive=parts.RampDrive(rate=0.0, angle=5.0)), "reel")
    tether = parts.Thread(reel="reel", length=1.0, line_density=1e-3, nodes=4, tip_mass=1.0, segments="inextensible")
    system.add(tether, "tether")
    run = system.simulate(until=0.1, every=0.1)
    (mark,) = run.ev.motion().marks
    np.testing.assert_array_equal(mark.points[:, 0], run["tether"].tip_position)


def test_labels_of_figures_fit_and_are_those_of_all_lines() -> None:
    """A long text gives way to the variable's name; that of one joint does not stand beside another one's force."""
    run = ev.load("andrews-mechanism").simulate(until=1e-3)
    joints = next(figure for figure in run.ev._system.figures(run) if figure.name == "joint")
    assert [panel.y_label for panel in joints.panels] == ["angle, deg", "x of force, N", "y of force, N"]
    boom = ev.load("boom-slew").simulate(until=2.0)
    assert show.figure(boom, ["boom.tip_deflection.y"]).panels[0].y_label == "tip deflection y, m"
    both = ["hub.rate.x", "hub.rate.z"]
    assert show.figure(boom, both).panels[0].y_label == "angular velocity x, z, deg/s"
    assert show.figure(boom, ["hub.rate"]).panels[0].y_label == "angular velocity, deg/s"


def test_round_off_is_not_drawn() -> None:
    """The hub of a balanced satellite stays where it is: its position, 1e-14 m, is no figure beside tips 20 m away."""
    run = ev.load("wire-boom-satellite").simulate(until=0.5)
    assert 0.0 < float(abs(run["hub"].position).max()) < 1e-11
    bodies = next(figure for figure in run.ev._system.figures(run) if figure.name == "rigid-body")
    assert [panel.y_label for panel in bodies.panels] == ["angular velocity, deg/s"]


@pytest.mark.slow
def test_a_vector_of_a_study_is_drawn_by_components() -> None:
    """Over one key each component is a line; over two the one that varies most is the map."""
    case = FALL | {"simulate": {"until": 1.0, "every": 0.5}}
    over = {"parts.ball.mass": [1.0, 2.0], "gravity.2": [-9.81, -1.62, -3.71]}
    found = studies.sweep({"study": "fall", "case": case, "over": over, "keep": ["ball.position.last"]})
    (title,) = (axis.get_title(loc="left") for axis in draw.figures(found)["ball_position_last"].axes[:1])
    assert title == "at axis = z"
    del over["parts.ball.mass"]
    found = studies.sweep({"study": "fall", "case": case, "over": over, "keep": ["ball.position.last"]})
    (axis,) = draw.figures(found)["ball_position_last"].axes
    assert [line.get_label() for line in axis.lines] == ["x", "y", "z"]
    assert sorted(axis.lines[2].get_ydata()) == pytest.approx([-4.905, -1.855, -0.81])


@pytest.mark.slow
def test_a_run_opened_by_another_process_is_drawn(tmp_path: pathlib.Path) -> None:
    path = str(tmp_path / "run.nc")
    ev.save(ev.load("solar-array").simulate(until=0.1, every=0.1), path)
    program = "import sys, evolvent; print(callable(evolvent.open(sys.argv[1]).ev.plot))"
    done = subprocess.run([sys.executable, "-c", program, path], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True"
