"""Mechanisms of the IFToMM benchmark, tops and pendulums against equations of motion in few unknowns."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from book import Book
from evolvent import System, parts
from evolvent.algebra import ordering
from evolvent.assembly.assembled import Assembly
from evolvent.solvers.time.implicit.energy_momentum import solve_energy
from evolvent.solvers.time.implicit.plan import matrix_of
from helpers import fitted_order, rotation, run as march
from implicit.rigs import coordinates, run

CHAPTER = "Rigid bodies"
G = 9.81
THIN = 1e-3


def four_bars(count: int) -> System:
    """Rods of 1 m and 1 kg: count + 1 upright ones on hinges, their tops joined by level ones; 1 m/s at the tops.

    A level rod's joints are points, which leaves it its own turn and makes nothing redundant.
    """
    system = System(gravity=(0.0, -G, 0.0))
    for k in range(count + 1):
        system.add(
            parts.RigidBody(mass=1.0, inertia=(1.0 / 12.0, THIN, 1.0 / 12.0), position=(k, 0.5, 0.0),
                            velocity=(0.5, 0.0, 0.0), angular_velocity=(0.0, 0.0, -1.0)), f"up{k}",
        )  # fmt: skip
        system.add(parts.Joint(a=(float(k), 0.0, 0.0), b=(f"up{k}", (0.0, -0.5, 0.0)), type="revolute"))
    for k in range(count):
        system.add(
            parts.RigidBody(mass=1.0, inertia=(THIN, 1.0 / 12.0, 1.0 / 12.0), position=(k + 0.5, 1.0, 0.0),
                            velocity=(1.0, 0.0, 0.0)), f"level{k}",
        )  # fmt: skip
        for side in (0, 1):
            system.add(
                parts.Joint(
                    a=(f"up{k + side}", (0.0, 0.5, 0.0)), b=(f"level{k}", (side - 0.5, 0.0, 0.0)), type="spherical"
                )
            )
    return system


@pytest.mark.slow
@pytest.mark.parametrize(("count", "published"), [(2, (0.3284581, 0.9445185)), (40, (0.1805122, 0.9835727))])
def test_four_bars(count: int, published: tuple[float, float], book: Book) -> None:
    """IFToMM A02: four-bars in a row, through the places where all rods lie level and a joint too many would hold."""
    inertia, weight = (count + 1) / 3.0 + count, G * (0.5 * (count + 1) + count)
    turned = solve_ivp(
        lambda t, y: [y[1], weight / inertia * np.sin(y[0])], (0.0, 10.0), [0.0, 1.0], "DOP853", rtol=1e-12, atol=1e-12
    ).y[0, -1]
    exact = np.array([np.sin(turned), np.cos(turned)])
    assert exact == pytest.approx(published, abs=1e-7)
    assembly = four_bars(count).assemble()
    found = run(assembly, [0.0, 10.0], step=5e-4, spectral_radius=0.9)
    place = 2.0 * coordinates(assembly, found.y, "up0")[-1, :2]
    book(
        CHAPTER, f"IFToMM A02, {count} four-bars, B0 at 10 s (h = 0.5 ms)", reference=f"{published} m",
        source="equation of one angle, SciPy DOP853", error=np.abs(place - exact).max(), allowed=5e-4, unit="m",
    )  # fmt: skip


def test_loops_cost_in_proportion_to_their_number() -> None:
    matrices = [matrix_of(four_bars(n).assemble().model) for n in (10, 20, 40)]
    for cost in ([ordering.operations(m) for m in matrices], [m.values.size for m in matrices]):
        assert cost[2] - cost[1] == pytest.approx(2 * (cost[1] - cost[0]), rel=0.05)


def test_heavy_top(book: Book) -> None:
    """A level top on a pivot, fast enough to precess without nodding: C w W = m g l."""
    mass, C, A, spin = 15.0, 0.46875, 0.234375, 50.0
    W, times = mass * G / (C * spin), np.linspace(0.0, 1.0, 11)
    errors, steps = [], (1e-3, 5e-4, 2.5e-4)
    for h in steps:
        system = System(gravity=(0.0, 0.0, -G))
        system.add(
            parts.RigidBody(mass=mass, inertia=(C, A, A), position=(1.0, 0.0, 0.0), velocity=(0.0, W, 0.0),
                            angular_velocity=(spin, 0.0, W)), "top",
        )  # fmt: skip
        system.add(parts.Joint(a=(0.0, 0.0, 0.0), b=("top", (-1.0, 0.0, 0.0))), "pivot")
        assembly = system.assemble()
        solution = run(assembly, times, step=h, spectral_radius=0.9, newton=1e-12)
        found = coordinates(assembly, solution.y, "top")[:, :3]
        exact = np.array([np.cos(W * times), np.sin(W * times), 0.0 * times]).T
        errors.append(np.abs(found - exact).max())
    order = fitted_order(steps, errors)
    assert order == pytest.approx(2.0, abs=0.15)
    book(
        CHAPTER, "Heavy top, level, precessing for one turn (generalized-alpha, 0.25 ms)",
        reference="W = m g l/(C w), no nodding", source="closed form", error=errors[-1], allowed=3e-5, unit="m",
        order=order, wanted="2",
    )  # fmt: skip


def test_double_pendulum(book: Book) -> None:
    """Two equal points on links of 1 m from level, against the textbook's two angles."""

    def rates(_: float, y: np.ndarray) -> list[float]:
        a, b, u, v = y
        c, s = np.cos(a - b), np.sin(a - b)
        M = np.array([[2.0, c], [c, 1.0]])
        r = np.array([-s * v * v - 2.0 * G * np.sin(a), s * u * u - G * np.sin(b)])
        return [u, v, *np.linalg.solve(M, r)]

    start = [0.5 * np.pi, 0.5 * np.pi, 0.0, 0.0]
    times = np.linspace(0.0, 3.0, 31)
    a, b = solve_ivp(rates, (0.0, 3.0), start, "DOP853", times, rtol=1e-12, atol=1e-12).y[:2]
    system = System(gravity=(0.0, -G, 0.0))
    for k, previous in ((1, (0.0, 0.0, 0.0)), (2, "p1")):
        system.add(parts.Point(mass=1.0, position=(float(k), 0.0, 0.0)), f"p{k}")
        system.add(parts.Joint(a=previous, b=f"p{k}", type="link"))
    seen = march(system.assemble(), times, rtol=1e-11, atol=1e-12)
    exact = np.array([np.sin(a) + np.sin(b), -np.cos(a) - np.cos(b)]).T
    book(
        CHAPTER, "Double pendulum from level for 3 s (Dormand-Prince, 1e-11)", reference="equations of two angles",
        source="SciPy DOP853, 1e-12", error=np.abs(seen.y[:, 3:5] - exact).max(), allowed=1e-7, unit="m",
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ Bricard

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1], [0, 0, 1]], dtype=float)
#: Axes of the joints at the corners; the first and the last one are on the ground, which is the sixth link.
AXES = np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0]], dtype=float)


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Turn about an axis."""
    k = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k


def links(q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Turns (5, 3, 3), corners (6, 3) and axes (6, 3) of the five links that move, from their joints' angles."""
    R, x = np.eye(3), CORNERS[0]
    turns, places, axes = [], [x], []
    for k in range(5):
        axes.append(R @ AXES[k])
        R = R @ about(AXES[k], q[k])
        x = x + R @ (CORNERS[k + 1] - CORNERS[k])
        turns.append(R)
        places.append(x)
    return np.array(turns), np.array(places), np.array([*axes, R @ AXES[5]])


def motion(q: np.ndarray) -> np.ndarray:
    """Rates of the angles in the mechanism's one motion, the first being 1: what keeps the last corner and its axis."""
    _, x, axes = links(q)
    closure = np.array([[*np.cross(axes[k], x[5] - x[k]), *np.cross(axes[k], axes[5])] for k in range(5)]).T
    _, size, found = np.linalg.svd(closure)
    assert size[4] < 1e-5 < 1e-2 < size[3]  # five angles, four conditions that count: the loop is overconstrained
    return found[-1] / found[-1, 0]


def inertia_and_height(q: np.ndarray) -> tuple[float, float]:
    """Twice the kinetic energy at a first rate of 1, and the sum of heights (along -GRAVITY) of the rods' middles."""
    rates = motion(q)
    _, x, axes = links(q)
    total, w, v = 0.0, np.zeros(3), np.zeros(3)
    for k in range(5):
        w = w + rates[k] * axes[k]
        arm = x[k + 1] - x[k]
        c = v + 0.5 * np.cross(w, arm)
        v = v + np.cross(w, arm)
        total += c @ c + ACROSS * (w @ w) - (ACROSS - ALONG) * (w @ arm) ** 2
    return total, float(-(0.5 * (x[:-1] + x[1:]) @ GRAVITY).sum() / G)


def bricard_exact(times: np.ndarray) -> np.ndarray:
    """Angles of the joints at times, let go at rest: M u' = -dM/2 u^2 - g dz, by the first joint's angle."""

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        q, u, d = y[:5], y[5], 1e-4
        n = motion(q)
        M = inertia_and_height(q)[0]
        ahead, behind = inertia_and_height(q + d * n), inertia_and_height(q - d * n)
        dM, dz = ((a - b) / (2.0 * d) for a, b in zip(ahead, behind, strict=True))
        return np.append(u * n, -(0.5 * dM * u * u + G * dz) / M)

    return solve_ivp(rates, (0.0, times[-1]), np.zeros(6), "DOP853", times, rtol=1e-9, atol=1e-10).y[:5].T


#: Square rods of 1 m, 1 kg and 0.1 m thickness: moments of inertia, kg m2; gravity as in the benchmark, whose y axis is
#: the other way round.
ACROSS, ALONG = (1.0 + 0.1**2) / 12.0, 0.1**2 / 6.0
GRAVITY = np.array([0.0, G, 0.0])
#: Corner 3 after 1 s and 5 s (IFToMM A04).
CORNER_3 = np.array([[0.5105015, 1.6491676, 0.1401231], [1.0, 1.0000673, 0.9999327]])


def bricard() -> System:
    """Rods along edges of a cube, on six hinges."""
    system = System(gravity=GRAVITY)
    for k in range(5):
        d = CORNERS[k + 1] - CORNERS[k]
        inertia = ACROSS * np.eye(3) - (ACROSS - ALONG) * np.outer(d, d)
        system.add(
            parts.RigidBody(mass=1.0, inertia=tuple(np.diag(inertia)), position=0.5 * (CORNERS[k] + CORNERS[k + 1])),
            f"rod{k}",
        )
        a = tuple(CORNERS[0]) if k == 0 else (f"rod{k - 1}", tuple(0.5 * (CORNERS[k] - CORNERS[k - 1])))
        system.add(parts.Joint(a=a, b=(f"rod{k}", tuple(-0.5 * d)), type="revolute", axis=AXES[k]), f"joint{k}")
    end = 0.5 * (CORNERS[5] - CORNERS[4])
    system.add(parts.Joint(a=tuple(CORNERS[5]), b=("rod4", tuple(end)), type="revolute", axis=AXES[5]), "joint5")
    return system


def corner_3(assembly: Assembly, y: np.ndarray) -> np.ndarray:
    """Place of corner 3 at all samples."""
    arm = 0.5 * (CORNERS[3] - CORNERS[2])
    return np.array([p[:3] + rotation(p[3:]) @ arm for p in coordinates(assembly, y, "rod2")])


@pytest.mark.slow
def test_bricard(book: Book) -> None:
    """IFToMM A04: six hinges, 30 constraints of which 29 are independent."""
    times = np.linspace(0.0, 0.6, 7)
    exact = np.array([links(q)[1][3] for q in bricard_exact(times)])
    assert np.abs(exact[-1] - exact[0]).max() > 0.3
    errors, steps = [], (2e-3, 1e-3, 5e-4)
    for h in steps:
        assembly = bricard().assemble()
        found = run(assembly, times, step=h, spectral_radius=0.9, newton=1e-12)
        assert (found.statistics["constraints"], found.statistics["rank"]) == (30, 29)
        errors.append(np.abs(corner_3(assembly, found.y) - exact).max())
    order = fitted_order(steps, errors)
    assert order == pytest.approx(2.0, abs=0.15)
    book(
        CHAPTER, "IFToMM A04, Bricard's mechanism, six hinges (h = 0.5 ms)", reference="corner 3 for 0.6 s",
        source="closure and Lagrange's equation, SciPy DOP853", error=errors[-1], allowed=1e-5, unit="m", order=order,
        wanted="2",
    )  # fmt: skip


@pytest.mark.slow
def test_bricard_against_the_published_places(book: Book) -> None:
    """IFToMM A04 by energy-momentum: what a run of 5 s keeps of its energy, and where corner 3 is then."""
    assembly = bricard().assemble()
    found = solve_energy(assembly, samples=[0.0, 1.0, 5.0], step=1e-3, spectral_radius=1.0)
    assert found.success
    assert (found.statistics["constraints"], found.statistics["rank"]) == (30, 29)
    assert np.abs(found.energy_defect).max() < 1e-5
    book(
        CHAPTER, "IFToMM A04, Bricard's mechanism (energy-momentum, h = 1 ms)", reference="corner 3 at 1 s and 5 s",
        source="IFToMM library of benchmarks", error=np.abs(corner_3(assembly, found.y)[1:] - CORNER_3).max(),
        allowed=3e-6, unit="m",
    )  # fmt: skip


# ------------------------------------------------------------------------------------------------ Andrews

#: Masses, kg, and moments of inertia, kg m2, of the seven bodies of Andrews' mechanism (Schiehlen 1990).
MASSES = np.array([0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498])
MOMENTS = np.array([2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5])
#: Pivots and the spring's end on the ground, m; the spring, N/m and m; the torque that drives, N m.
A, B, C = np.array([-0.06934, -0.00227]), np.array([-0.03635, 0.03273]), np.array([0.014, 0.072])
STIFFNESS, LENGTH, MOTOR = 4530.0, 0.07785, 0.033
#: Angles at the start and, by the IVP test set (Mazzia & Magherini 2008), after 0.03 s, rad.
BEGIN = np.array(
    [-0.0617138900142764, 0.0, 0.45527981916307, 0.222668390165886, 0.487364979543843, -0.222668390165886,
     1.23054744454982]
)  # fmt: skip
PUBLISHED = np.array(
    [15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
     0.5347301163226948, 1.048080741042263]
)  # fmt: skip


def along(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), np.sin(angle)])


def down(angle: float) -> np.ndarray:
    """`along` turned back by a right angle."""
    return np.array([np.sin(angle), -np.cos(angle)])


def squeezer(q: np.ndarray) -> dict[str, np.ndarray]:
    """Places of Andrews' mechanism from its seven angles: joints F, E (of four bodies), G, H; D of the spring; middles.

    Notes
    -----
    Angles and dimensions of Hairer & Wanner, Solving ODEs II, VI.9: beta, Theta, gamma, Phi, delta, Omega, epsilon.
    """
    beta, theta, gamma, phi, delta, omega, epsilon = q
    F = 0.007 * along(beta)
    G, H = A + 0.04 * along(delta), A + 0.04 * down(epsilon)
    middles = [
        0.00092 * along(beta),
        F - 0.0115 * along(beta + theta),
        B + 0.01874 * down(gamma) + 0.01043 * along(gamma),
        G + (0.02 - 0.01421) * down(phi + delta),
        A + 0.02308 * along(delta) + 0.00916 * down(delta),
        H + (0.02 - 0.01421) * along(omega + epsilon),
        A + 0.01228 * down(epsilon) + 0.00449 * along(epsilon),
    ]
    return {
        "F": F, "G": G, "H": H, "E": F - 0.028 * along(beta + theta), "E3": B + 0.035 * down(gamma),
        "E4": G + 0.02 * down(phi + delta), "E6": H + 0.02 * along(omega + epsilon),
        "D": B + 0.018 * down(gamma) + 0.02 * along(gamma), "middles": np.array(middles),
    }  # fmt: skip


def andrews() -> System:
    """The mechanism in space: bodies on the ground on hinges, links between them on points, so nothing is redundant."""
    system, x = System(), squeezer(BEGIN)

    def local(body: int, place: np.ndarray) -> tuple[str, tuple[float, ...]]:
        return f"k{body}", (*(place - x["middles"][body - 1]), 0.0)

    for k in range(7):
        system.add(parts.RigidBody(mass=MASSES[k], inertia=MOMENTS[k], position=(*x["middles"][k], 0.0)), f"k{k + 1}")
    for body, pivot in ((1, np.zeros(2)), (3, B), (5, A), (7, A)):
        system.add(parts.Joint(a=(*pivot, 0.0), b=local(body, pivot), type="revolute", axis=(0.0, 0.0, 1.0)))
    for one, other, place in ((1, 2, "F"), (3, 2, "E"), (5, 4, "G"), (3, 4, "E"), (7, 6, "H"), (3, 6, "E")):
        system.add(parts.Joint(a=local(one, x[place]), b=local(other, x[place]), type="spherical"))
    system.add(parts.Spring(a=(*C, 0.0), b=local(3, x["D"]), stiffness=STIFFNESS, length=LENGTH))
    system.add(parts.Load(at="k1", torque=(0.0, 0.0, MOTOR)))
    return system


def test_andrews(book: Book) -> None:
    """IFToMM A03, Andrews' squeezing mechanism: seven bodies of one motion in three loops."""
    start, end = squeezer(BEGIN), squeezer(PUBLISHED)
    for x in (start, end):  # the three loops are closed, by the published angles too
        assert np.abs([x["E"] - x[name] for name in ("E3", "E4", "E6")]).max() < 1e-14
    errors, steps = [], (4e-5, 2e-5, 1e-5)
    for h in steps:
        assembly = andrews().assemble()
        solution = run(assembly, [0.0, 0.03], step=h, spectral_radius=0.9, newton=1e-12)
        gaps = []
        for body, name in ((1, "F"), (2, "E"), (3, "D"), (5, "G"), (7, "H")):
            arm = np.append(start[name] - start["middles"][body - 1], 0.0)
            p = coordinates(assembly, solution.y, f"k{body}")[-1]
            gaps.append((p[:3] + rotation(p[3:]) @ arm)[:2] - end[name])
        errors.append(np.abs(gaps).max())
    order = fitted_order(steps, errors)
    assert order == pytest.approx(2.0, abs=0.15)
    book(
        CHAPTER, "IFToMM A03, Andrews' mechanism (h = 10 us)", reference="five places at 0.03 s, from seven angles",
        source="IVP test set, Mazzia & Magherini 2008", error=errors[-1], allowed=2e-6, unit="m", order=order,
        wanted="2",
    )  # fmt: skip
