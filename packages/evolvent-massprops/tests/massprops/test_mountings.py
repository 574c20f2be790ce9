"""Bodies on springs in several mountings, with tare and air: against bodies put together by hand, and closed forms."""

from __future__ import annotations

import math
import pathlib
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from book import Book
from evolvent_base.cli import commands
from evolvent_base.errors import InputError
from evolvent_base.signals import Signals
from evolvent_massprops import mass_properties
from evolvent_massprops.description import for_recording, load
from evolvent_massprops.inertia import Body, Stand, air, linear_model
from evolvent_massprops.inertia.combined import Combined
from evolvent_massprops.inertia.problem import problem
from evolvent_massprops.inertia.stand import Mounting
from evolvent_massprops.springs_inputs import Input, SpringsTask
from evolvent_massprops.springs_search import Recording, mountings
from evolvent_massprops.springs_uncertainty import budget_of

Array = np.ndarray
CHAPTER = "Inertia stand and identification"
A, B, K = 0.6, 0.4, 20000.0
STAND: dict[str, Any] = {"stiffness": K, "length": 0.3, "damping": 4.0}
MASS, CENTRE = 120.0, np.array([0.03, -0.02, 0.01])
TENSOR = np.array([[9.0, 0.4, -0.3], [0.4, 14.0, 0.5], [-0.3, 0.5, 11.0]])
CRADLE_MASS, CRADLE_CENTRE, CRADLE = 40.0, np.array([0.0, 0.05, 0.0]), np.diag([4.0, 7.0, 5.0])
UP, SIDE, END = np.eye(3), np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]), np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
TRUE = {
    "mass": MASS, "offset_x": 0.03, "height": 0.02, "offset_z": 0.01, "Ixx": 9.0, "Iyy": 14.0, "Izz": 11.0,
    "Ixy": 0.4, "Ixz": -0.3, "Iyz": 0.5, "tare.0.Ixx": 4.0, "tare.0.Izz": 5.0,
}  # fmt: skip
TURNS = {"up.csv": UP, "side.csv": SIDE, "end.csv": END}


def together(R: Array | None, *, cradle: bool = True) -> Body:
    """Body, turned by R, and cradle as one, by hand; the cradle alone for None."""
    pieces = [(CRADLE_MASS, CRADLE_CENTRE, CRADLE)] if cradle else []
    if R is not None:
        pieces.append((MASS, R @ CENTRE, R @ TENSOR @ R.T))
    mass = sum(m for m, _, _ in pieces)
    centre = sum(m * c for m, c, _ in pieces) / mass
    apart = [(m, c - centre, tensor) for m, c, tensor in pieces]
    tensor = sum(tensor + m * (d @ d * np.eye(3) - np.outer(d, d)) for m, d, tensor in apart)
    return Body(mass=mass, centre=centre, inertia=tensor)


def record(name: str, body: Body, *, seed: int, noise: float = 2e-5, **stand: Any) -> Signals:
    """A recording after a pull of 80 N is released at the first spring."""
    s = Stand.rectangle(A, B, **(STAND | stand))
    modes, t = linear_model(s, body).modes(), np.arange(240) / 40.0
    x = modes.motion(t, modes.release((0.0, -80.0, 0.0), s.points[0]), s.points).T
    x = x + noise * np.random.default_rng(seed).standard_normal(x.shape)
    names = tuple(f"sensor {k}" for k in (1, 2, 3, 4))
    return Signals.of(names, x, ("m",) * 4, 40.0, path=name, sha256=f"{name}{seed}")


def recordings(*, only: tuple[str, ...] = tuple(TURNS), seed: int = 1) -> list[Signals]:
    """The body in mountings, then the cradle alone."""
    found = [record(name, together(TURNS[name]), seed=seed + k) for k, name in enumerate(only)]
    return [*found, record("empty.csv", together(None), seed=seed + 9)]


def description() -> dict[str, Any]:
    """Everything of the body is unknown, and two moments of the cradle."""
    unknown = ("mass", "offset_x", "offset_z", "height", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
    return {
        "signals": {"sensors": [{"column": f"sensor {k}", "point": k} for k in (1, 2, 3, 4)]},
        "stand": {
            "kind": "springs", "half_length": "0.6 m +- 0.1 mm", "half_width": "0.4 m +- 0.1 mm",
            "stiffness": "20000 N/m +- 0.05 %", "natural_length": "0.3 m",
        },
        "body": dict.fromkeys(unknown, "unknown"),
        "tare": [
            {"name": "cradle", "mass": "40 +- 0.01 kg", "height": "-50 mm", "Ixx": "unknown",
             "Iyy": "7 +- 0.1 kg m^2", "Izz": "unknown"}
        ],
        "identification": {"order": 3},
        "recordings": {
            "up.csv": {}, "side.csv": {"mounting.rotation": "90 deg about x"},
            "end.csv": {"mounting.rotation": "90 deg about z"}, "empty.csv": {"mounting.body": False},
        },
    }  # fmt: skip


@pytest.mark.slow
def test_four_sensors_and_three_mountings_give_the_whole_tensor(book: Book) -> None:
    found = mass_properties(recordings(), description())
    off = np.array([(found[key] - TRUE[key]) / u for key, u in zip(TRUE, found.std, strict=True)])
    assert [o.key for o in found.outputs] == list(TRUE)
    assert np.abs(off).max() < 4.0
    assert max(found.std[4:7] / found.values[4:7]) < 2e-3
    assert found.evaluations[0].cannot == ()
    assert "over 4 recordings in 3 mountings and 1 without the body" in found.evaluations[0].why[-1]
    assert all(0.3 < e.consistency < 2.0 for e in found.evaluations)
    # the springs' stiffness acts on body and cradle alike
    R = found.covariance / np.outer(found.std, found.std)
    assert R[list(TRUE).index("Ixx"), list(TRUE).index("tare.0.Ixx")] > 0.5
    assert not found.warnings
    book(
        CHAPTER, "Ten mass properties from four sensors, three mountings and the empty cradle",
        reference="put into the simulation", source="bodies put together by hand",
        error=float(np.abs(off).max()), allowed=4.0, unit="u",
    )  # fmt: skip


@pytest.mark.slow
def test_two_mountings_leave_a_product_open() -> None:
    """Of normals n1 and n2 of the platform in the body, n1.I n2 does not act on heave, roll and pitch."""
    two = recordings(only=("up.csv", "side.csv"))
    with pytest.raises(InputError, match=r"Iyz does not show in the data; 2 mountings of the body are recorded: turn"):
        mass_properties(two, description())
    content = description()
    content["body"]["Iyz"] = "0.5 +- 0.1 kg m^2"
    found = mass_properties(two, content)
    assert any("Iyz does not show" in why for _, why in found.evaluations[0].cannot)
    for key, u in zip([o.key for o in found.outputs], found.std, strict=True):
        assert abs(found[key] - TRUE[key]) < 4.0 * u, key


@pytest.mark.slow
def test_a_wrong_rotation_is_contradicted() -> None:
    content = description()
    content["recordings"]["end.csv"]["mounting.rotation"] = "-90 deg about z"
    text = " ".join(mass_properties(recordings(), content).warnings)
    assert "the recordings contradict one another or the model: chi-square is" in text
    assert "check rotation and position of each mounting" in text


def _problems(unknown: tuple[str, ...]) -> tuple[Combined, list[Input], SpringsTask]:
    """The three mountings and the empty cradle without noise, with covariances of the size of a recording's."""
    s, base = Stand.rectangle(A, B, **STAND), Body(mass=MASS, centre=CENTRE, inertia=TENSOR)
    found, own = [], []
    for R in (UP, SIDE, END, None):
        modes = linear_model(s, together(R)).modes()
        seen = np.argsort(-np.abs(modes.at(s.points)).max(axis=1))[:3]
        w, v = modes.natural_frequency[seen], modes.at(s.points)[seen]
        v = v / np.abs(v).max(axis=1)[:, None]
        names = unknown if R is not None else tuple(n for n in unknown if n.startswith("tare"))
        mounting = Mounting(
            rotation=UP if R is None else R, occupied=R is not None, tare_mass=np.array([CRADLE_MASS]),
            tare_centre=CRADLE_CENTRE[None], tare_inertia=CRADLE[None],
        )  # fmt: skip
        found.append(
            problem(
                s,
                base,
                names,
                w,
                frequency_covariance=np.diag((1e-5 * w) ** 2),
                shapes=v,
                points=s.points,
                shape_covariance=np.broadcast_to(4e-6 * np.eye(4), (3, 4, 4)),
                mounting=mounting,
            )
        )
        own.append(names)
    p = Combined(problems=tuple(found), unknown=unknown, own=tuple(own))
    inputs = [Input(("stiffness", k), f"stiffness {k + 1}", K, 5e-4 * K, "N/m") for k in range(4)]
    inputs += [Input(("tare1_mass",), "tare.0.mass", CRADLE_MASS, 0.02, "kg")]
    inputs += [Input((f"turn_{a}",), f"alignment {a}", 0.0, 1e-3, "rad", (k,)) for k in (1, 2) for a in "xyz"]
    task: Any = SpringsTask(None, None, (), s, s.points, s.points, unknown, K)  # type: ignore[arg-type]
    return p, inputs, task


@pytest.mark.slow
def test_draws_scatter_as_the_covariance_says(book: Book) -> None:
    """300 stands, cradles, attitudes and noises are drawn, put together by hand, and estimated."""
    unknown = ("mass", "ex", "h", "ez", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz", "tare1_Ixx", "tare1_Izz")
    p, inputs, task = _problems(unknown)
    true = p.initial_estimate
    reported = np.sqrt(np.diag(budget_of(task, p, true, inputs, ()).covariance))
    n, random = 300, np.random.default_rng(3)
    stiffness = K * (1.0 + 5e-4 * random.standard_normal((n, 4)))
    cradle = CRADLE_MASS + 0.02 * random.standard_normal(n)
    errors = 1e-3 * random.standard_normal((2, n, 3))
    s = Stand.rectangle(A, B, **(STAND | {"stiffness": stiffness}))
    data = []
    for k, (part, R) in enumerate(zip(p.problems, (UP, SIDE, END, None), strict=True)):
        turned = np.broadcast_to(np.eye(3), (n, 3, 3))
        if k in (1, 2):
            from scipy.spatial.transform import Rotation

            turned = Rotation.from_rotvec(errors[k - 1]).as_matrix()
        modes = linear_model(s, _drawn(turned @ (UP if R is None else R), cradle, occupied=R is not None)).modes()
        order = np.argsort(-np.abs(modes.at(s.points)).max(axis=-1), axis=-1)[:, :3]
        w = np.take_along_axis(modes.natural_frequency, order, axis=-1)
        v = np.take_along_axis(modes.at(s.points), order[..., None], axis=-2)
        assert part.shapes is not None
        # modes in the order and sign of the nominal ones
        pair = np.argmax(
            np.abs(np.einsum("ms,nks->nmk", part.shapes, v)) / np.linalg.norm(v, axis=-1)[:, None], axis=-1
        )
        w = np.take_along_axis(w, pair, axis=-1)
        v = np.take_along_axis(v, pair[..., None], axis=-2)
        v = v * (np.sum(v * part.shapes, axis=-1) / np.sum(v * v, axis=-1))[..., None]
        noise = (1e-5 * part.frequency * random.standard_normal(w.shape), 2e-3 * random.standard_normal(v.shape))
        data.append((w + noise[0], v + noise[1]))
    scale = p.scale
    P = scale[:, None] * np.linalg.pinv(p.jacobian(true) * scale)
    values = np.broadcast_to(true, (n, len(true)))
    for _ in range(8):
        rows = [part.residual(values[:, places], (), None, *data[k]) for k, (part, places) in enumerate(p.parts)]
        values = values - p.joined(rows, values) @ P.T
    scatter = values.std(axis=0, ddof=1)
    ratio, bias = scatter / reported, (values.mean(axis=0) - true) / reported
    assert np.abs(ratio - 1.0).max() < 4.5 / math.sqrt(2.0 * n)  # a deviation of n draws has one of 1/sqrt(2 n)
    assert abs(np.mean(ratio) - 1.0) < 0.06
    assert np.abs(bias).max() < 4.5 / math.sqrt(n)
    book(
        CHAPTER, "Combined mountings: scatter of all ten properties", reference="reported covariance",
        source=f"{n} drawn stands, cradles, attitudes and noises", error=float(np.abs(ratio - 1.0).max()), allowed=0.19,
    )  # fmt: skip


def _drawn(R: Array, cradle: Array, *, occupied: bool) -> Body:
    """`together` for rotations (n, 3, 3) and masses of the cradle (n,)."""
    mass = cradle + (MASS if occupied else 0.0)
    own = R @ CENTRE
    centre = (cradle[:, None] * CRADLE_CENTRE + (MASS * own if occupied else 0.0)) / mass[:, None]
    d, e = CRADLE_CENTRE - centre, own - centre

    def steiner(x: Array) -> Array:
        return np.einsum("ni,ni->n", x, x)[:, None, None] * np.eye(3) - x[:, :, None] * x[:, None, :]

    tensor = CRADLE + cradle[:, None, None] * steiner(d)
    if occupied:
        tensor = tensor + R @ TENSOR @ np.swapaxes(R, 1, 2) + MASS * steiner(e)
    return Body(mass=mass, centre=centre, inertia=tensor)


# ------------------------------------------------------------------------------------------------ closed forms


def level(**changes: Any) -> dict[str, Any]:
    """A guided stand with everything centred, on which roll is sqrt(4 k b^2/I)."""
    content = description() | {
        "body": {
            "mass": "unknown", "offset_x": "0 m", "offset_z": "0 m", "height": "0 m", "Ixx": "unknown",
            "Iyy": "14 kg m^2", "Izz": "unknown",
        },
        "recordings": {},
    }  # fmt: skip
    content["stand"] = {"kind": "springs", "support": "guided", "half_length": "0.6 m", "half_width": "0.4 m",
                        "stiffness": "20000 N/m", "natural_length": "0.3 m"}  # fmt: skip
    del content["tare"]
    return content | changes


def centred(mass: float, moments: tuple[float, float, float]) -> Signals:
    """A recording of a centred body on a guided stand."""
    return record("a.csv", Body(mass=mass, centre=(0.0, 0.0, 0.0), inertia=moments), seed=1, support="guided")


@pytest.mark.slow
def test_a_known_tare_is_taken_off() -> None:
    """I = 4 k b^2/w^2 - I_tare; the tare's uncertainty is the result's."""
    tare = [{"mass": "40 +- 0.5 kg", "Ixx": "4 +- 0.2 kg m^2", "Iyy": "7 kg m^2", "Izz": "5 +- 0.1 kg m^2"}]
    found = mass_properties(centred(160.0, (13.0, 21.0, 16.0)), level(tare=tare))
    np.testing.assert_allclose([found["mass"], found["Ixx"], found["Izz"]], [120.0, 9.0, 11.0], rtol=1e-3)
    share = {s.label: s.contribution for s in found.shares}
    np.testing.assert_allclose(share["tare.0.mass"], [-0.5, 0.0, 0.0], atol=2e-3)
    np.testing.assert_allclose(share["tare.0.Ixx"], [0.0, -0.2, 0.0], atol=2e-3)
    np.testing.assert_allclose(share["tare.0.Izz"], [0.0, 0.0, -0.1], atol=2e-3)


@pytest.mark.slow
def test_air_of_a_disc_is_taken_off(book: Book) -> None:
    """A disc of 0.5 m radius: 8/3 rho r^3 of mass, 16/45 rho r^5 of moment, with the stated uncertainty of both."""
    rho, r = 1.2, 0.5
    mass, moment = 8.0 / 3.0 * rho * r**3, 16.0 / 45.0 * rho * r**5
    signals = centred(8.0 + mass, (0.5 + moment, 0.9, 0.6 + moment))
    content = level(air={"density": "1.2 kg/m^3", "shapes": [{"disc": {"radius": "0.5 m", "factor": "1 +- 0.1"}}]})
    content["body"] |= {"Iyy": "0.9 kg m^2"}
    s = Stand.rectangle(A, B, **(STAND | {"stiffness": 400.0, "support": "guided"}))
    content["stand"] |= {"stiffness": "400 N/m"}
    body = Body(mass=8.0 + mass, centre=(0.0, 0.0, 0.0), inertia=(0.5 + moment, 0.9, 0.6 + moment))
    modes, t = linear_model(s, body).modes(), np.arange(240) / 40.0
    x = modes.motion(t, modes.release((0.0, -1.0, 0.0), s.points[0]), s.points).T
    x = x + 1e-6 * np.random.default_rng(1).standard_normal(x.shape)
    names = tuple(f"sensor {k}" for k in (1, 2, 3, 4))
    signals = Signals.of(names, x, ("m",) * 4, 40.0, path="a", sha256="a")
    found, without = mass_properties(signals, content), mass_properties(signals, {**content, "air": None})
    taken = without.values - found.values
    expected = np.array([mass, moment, moment])
    np.testing.assert_allclose(taken, expected, rtol=2e-3)
    share = {s.label: s.contribution for s in found.shares}
    np.testing.assert_allclose(share["air.shapes.0.factor"], -0.1 * expected, rtol=2e-2)
    book(
        CHAPTER, "Air of a disc on the stand, taken off", reference="8/3 rho r^3, 16/45 rho r^5",
        source="Lamb, closed form", error=float(np.abs(taken / expected - 1.0).max()), allowed=2e-3,
    )  # fmt: skip


def test_added_mass_of_shapes(book: Book) -> None:
    """Closed forms; of plates the coefficients of DNV-RP-C205 (2010), table D-2, over pi/4 w^2 l."""
    np.testing.assert_allclose(np.diag(air.sphere(0.3)[0]), 0.5 * 4.0 / 3.0 * math.pi * 0.027)
    A_, J = air.cylinder(0.1, 2.0, np.array([0.0, 0.0, 2.0]))
    np.testing.assert_allclose(np.diag(A_), np.array([1.0, 1.0, 0.0]) * math.pi * 0.01 * 2.0)
    np.testing.assert_allclose(np.diag(J), np.array([1.0, 1.0, 0.0]) * math.pi * 0.01 * 8.0 / 12.0)
    table = {1.0: 0.579, 1.5: 0.690, 2.0: 0.757, 4.0: 0.872, 10.0: 0.947}
    found = {r: air.potential_flow(r, 1.0)[0] / (0.25 * math.pi * r) for r in table}
    off = max(abs(found[r] / c - 1.0) for r, c in table.items())
    assert off < 5e-3
    long = air.plate(40.0, 1.0, np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    assert long[0][1, 1] == pytest.approx(0.25 * math.pi * 40.0, rel=0.02)
    assert long[1][0, 0] == pytest.approx(math.pi / 128.0 * 40.0, rel=0.02)
    assert long[1][2, 2] == pytest.approx(0.25 * math.pi * 40.0**3 / 12.0, rel=0.03)
    book(
        CHAPTER, "Added mass of rectangular plates by potential flow", reference="coefficients 0.579 to 0.947",
        source="DNV-RP-C205, table D-2", error=off, allowed=5e-3,
    )  # fmt: skip


@pytest.mark.slow
def test_a_common_factor_is_reported_itself() -> None:
    """The stated start is 1.02, and so are the springs; single recording and combined estimate report the same."""
    true = record("a.csv", Body(mass=160.0, centre=(0.0, 0.0, 0.0), inertia=(13.0, 21.0, 16.0)), seed=1,
                  support="guided", stiffness=1.02 * K)  # fmt: skip
    content = level()
    content["body"] |= {"mass": "160 kg"}
    content["stand"] |= {"common_factor": "unknown near 1.02 +- 0.01"}
    alone = mass_properties(true, content)
    joint = mass_properties(true, {**content, "mounting": {"rotation": "none"}})
    assert joint["common_factor"] == pytest.approx(1.02, rel=1e-3)
    assert alone["common_factor"] == pytest.approx(1.02, rel=1e-3)


def test_unknown_positions_are_equal_mountings() -> None:
    own = {"mounting.position": ["unknown", "0 m", "0 m"]}
    given = [load({**level(), "recordings": {"a.csv": own, "b.csv": own}})]
    several = [for_recording(given[0], name)[0] for name in ("a.csv", "b.csv")]
    made: Any = [Recording(one, None, (), "a") for one in several]  # type: ignore[arg-type]
    assert mountings(made) == [0, 0]


# ------------------------------------------------------------------------------------------------ refusals


LIGHT = {"mass": "1 kg", "Ixx": "0.1 kg m^2", "Iyy": "0.1 kg m^2", "Izz": "0.1 kg m^2"}
NO_IYY = {"mass": "unknown", "offset_x": "0 m", "offset_z": "0 m", "height": "0 m", "Ixx": "unknown", "Izz": "unknown"}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"mounting.rotation": "90 deg"}, "mounting.rotation is '90 deg'; it must be none, a turn such as"),
        ({"mounting.rotation": "90 m about x"}, "mounting.rotation is '90 m about x'; it must be"),
        ({"mounting.alignment": "-1 deg"}, "mounting.alignment"),
        ({"mounting.rotaton": "none"}, "unknown key 'mounting.rotaton'; did you mean 'mounting.rotation'"),
        ({"tare.0.Ixx": "-1 kg m^2"}, "tare.0.Ixx"),
        (
            {"tare": [{"name": "cradle", "Ixx": "1", "Iyy": "9", "Izz": "1"}]},
            "'cradle' has an inertia that no body has",
        ),
        ({"tare": [], "mounting.body": False}, "mounting.body is false, but tare is missing"),
        ({"air": {"shapes": []}}, "air.shapes"),
        ({"air": {"shapes": [{"cone": {"radius": "1 m"}}]}}, "air.shapes.0"),
        ({"air": {"shapes": [{"sphere": {"radius": "0 m"}}]}}, "radius"),
        (
            {"air": {"shapes": [{"plate": {"length": "1 m", "width": "1 m", "along": [0, 1, 0]}}]}},
            "its length lies across its normal",
        ),
        ({"recordings": {"a.csv": {"mounting.body": False}}}, "mounting.body is false for all recordings"),
        ({"mounting.body": False, "tare.0.mass": "0 kg"}, "tare.0.mass is 0; without the body it must be above 0"),
        ({"mounting.body": False, "tare": [{"mass": "1 kg"}]}, "tare.0.Ixx is 0; without the body it must be above 0"),
        ({"identification.shapes": False}, "identification.shapes is false, and without shapes several pairs"),
        (
            {
                "stand.common_factor": "unknown",
                "recordings": {"a.csv": {"stand.stiffness": "20000 N/m"}},
                "body.mass": "120 kg",
            },
            "recordings.a.csv.stand.stiffness is given and stand.common_factor is unknown",
        ),
        ({"mounting.rotation": "90 deg about x", "body": NO_IYY}, "body.Iyy is missing, and a.csv has y out of"),
    ],
)
def test_what_mountings_refuse(changes: Mapping[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said) as error:
        mass_properties(centred(160.0, (13.0, 21.0, 16.0)), level(tare=[LIGHT]), changes)
    assert "\n" not in str(error.value)


@pytest.mark.slow
@pytest.mark.usefixtures("outlined")
def test_the_command_writes_a_certificate(tmp_path: pathlib.Path) -> None:
    content = description() | {"recordings": {"a.csv": {}, "b.csv": {"mounting.rotation": "90 deg about x"}}}
    content["body"] |= {"Iyz": "0.5 kg m^2"}
    content["tare"][0] |= {"Ixx": "4 kg m^2", "Izz": "5 kg m^2"}
    stand = tmp_path / "stand.yaml"
    stand.write_text(yaml.safe_dump(content), encoding="utf-8")
    paths = []
    for name, R in (("a.csv", UP), ("b.csv", SIDE)):
        signals = record(name, together(R), seed=len(name))
        t = np.arange(len(signals.data)) / signals.rate
        head = ",".join(["time (s)", *(f"{n} (m)" for n in signals.names)])
        np.savetxt(tmp_path / name, np.column_stack([t, signals.data]), delimiter=",", header=head, comments="")
        paths.append(str(tmp_path / name))
    page = tmp_path / "certificate.html"
    done = CliRunner().invoke(commands, ["identify", *paths, "--stand", str(stand), "-o", str(page)])
    assert done.exit_code == 0, done.output
    assert "One least squares of frequencies and mode shapes over 2 recordings in 2 mountings" in done.output
    assert "misfit" in done.output
    assert "All recordings are in one estimate." in page.read_text(encoding="utf-8")
    wrong = CliRunner().invoke(
        commands, ["identify", *paths, "--stand", str(stand), "--set", "mounting.rotation=90 deg"]
    )
    assert wrong.exit_code != 0
