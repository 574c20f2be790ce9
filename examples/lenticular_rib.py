"""
A rib of lenticular section, wound on a hub
===========================================

How much stiffer is a rib once its section springs open, how fast does it unwind, and can its root stop it?
"""

# %%
# The plain rib is that of the wrapped-rib paper (Yi, Yuan, Dong & Li 2017): a strip of 12 m x 30 mm x 0.3 mm on a hub
# of 0.6 m. Both lenticular sections are **chosen**, no flight hardware: two walls of the same material, hub, length
# and mass per length, a wide and a narrow one.

import math

import matplotlib.pyplot as plt
import numpy as np

from evolvent import System, closed_forms, parts
from evolvent.elements import Lenticular, Material, Rectangle

HUB, LENGTH, LINE_DENSITY = 0.6, 12.0, 0.0144
FILM = Material(young_modulus=5e6, poisson_ratio=0.3, density=1600.0)
PLAIN = Rectangle(thickness=3e-4, width=0.03)
WIDE = Lenticular(radius=0.5, angle=0.12, thickness=7.5e-5)  # 60 mm wide
NARROW = Lenticular(radius=0.15, angle=0.2, thickness=1.5e-4)  # 30 mm wide


def law(section, curvature):
    """Moment (N m) and energy per length (J/m) of a section at a curvature (1/m)."""
    if isinstance(section, Lenticular):
        return closed_forms.flattened_bending(section, FILM, curvature)
    bending = FILM.E * section.properties(FILM.nu).Iz
    return bending * curvature, 0.5 * bending * curvature**2


# %%
# On the hub a length stores the energy :math:`w` of the curvature :math:`1/R`. Without losses it becomes kinetic
# energy of the free tail, straight and of length :math:`l`: :math:`m l v^2/6 = w l`, so that the tip has the speed
# :math:`v = \sqrt{6 w/m}` and all is unwound at :math:`L^2/(2 v R)`. These are the closed forms of the plain rib with
# :math:`2 w R^2` in place of :math:`EI`.
#
# A root that is clamped to the hub then stops a rib that turns at :math:`v/L`. As long as it is elastic the first
# mode of the cantilever has the root moment :math:`1.138\,v\sqrt{EI\,m}`.


def unwinding(section, length=LENGTH):
    """The rib as a strip that has the energy of the section on the hub."""
    energy = float(law(section, 1.0 / HUB)[1])
    return closed_forms.Strip(
        radius=HUB,
        length=length,
        line_density=LINE_DENSITY,
        bending_stiffness=2.0 * energy * HUB**2,
        axial_stiffness=45.0,
    )


STOPPED = 4.0 / 1.875104**2
table = {}
for name, section in (("plain", PLAIN), ("wide lens", WIDE), ("narrow lens", NARROW)):
    strip, stiffness = unwinding(section), float(law(section, 1e-6)[0]) / 1e-6
    speed = closed_forms.deployment_speed(strip)
    table[name] = {
        "bending stiffness, uN m2": 1e6 * stiffness,
        "energy wound, nJ/m": 1e9 * closed_forms.bending_energy(strip) / LENGTH,
        "energy of a radian, nJ": 1e9 * closed_forms.bending_energy(strip) / LENGTH * HUB,
        "tip speed, mm/s": 1e3 * speed,
        "time to unwind, s": closed_forms.deployment_time(strip),
        "root moment if elastic, uN m": 1e6 * STOPPED * speed * math.sqrt(stiffness * LINE_DENSITY),
    }
    if section is not PLAIN:
        snap = closed_forms.snap(section, FILM)
        table[name] |= {
            "snaps at, uN m": 1e6 * snap.peak_moment,
            "at the curvature, 1/m": snap.peak_curvature,
            "least energy of a radian, nJ": 1e9 * snap.propagation_moment,
            "fold radius, m": snap.fold_radius,
        }
print(f"{'':30}" + "".join(f"{name:>13}" for name in table))
for row in table["wide lens"]:
    cells = (f"{rib[row]:13.4g}" if row in rib else f"{'-':>13}" for rib in table.values())
    print(f"{row:30}" + "".join(cells))

# %%
# The wide lens is 58 times stiffer than the strip of the same mass, and unwinds 2.5 times *slower*: its thin walls
# store less on the hub. The narrow lens is 40 times stiffer and unwinds 1.9 times faster, for most of its energy is
# that of flattening.
#
# Both snap at a fraction of the root moment that would stop an elastic rib: the end of the unwinding needs a damper
# or a motor. A fold has a radius of its own, at which a radian has the least energy. It should be close to that of
# the hub: the coil of the narrow lens has 1.75 times the least energy, which it could lose by leaving the hub for
# tighter folds.
#
# A run follows a wide lens of 0.6 m, of which 0.48 m are wound. The root is clamped to the fixed hub, without a
# damper.

SHORT, WOUND = 0.6, 0.48


def run(elements=200, until=90.0):
    """The unwinding of a short rib from rest."""
    system = System(title="lenticular rib")
    system.add(parts.RigidBody(motion="driven", rate=0.0), "hub")
    rib = parts.Rod(
        length=SHORT, section=WIDE, material=FILM, elements=elements, position=(0.0, -HUB, 0.0), stiffness_damping=0.02,
        folds=({"at": WOUND / 2, "angle": WOUND / HUB, "radius": HUB},),
    )  # fmt: skip
    system.add(rib, "rib")
    system.add(parts.Joint(a=("hub", (0.0, -HUB, 0.0)), b="rib.root", type="clamp"), "root")
    coil = parts.Contact(a="rib", b="hub", shape=parts.Cylinder(radius=HUB), law="conservative", stiffness=0.1)
    system.add(coil, "coil")
    return system.simulate(until=until, every=0.25, method="energy-momentum", step=0.05).ev.regular()


# %%
# The tail of the length :math:`l_0` that is free at the start takes part of the energy:
# :math:`v = \sqrt{(6 w/m) (1 - l_0/l)}`.


def compare(found):
    """Time and tip speed of a run, and its figures beside the closed form."""
    time, angle = found["time"].values, found["rib"]["fold_angle"].values
    stored, kinetic = found["energy_elastic"].values, found["energy_kinetic"].values
    tail = np.clip(SHORT - HUB * angle, SHORT - WOUND, SHORT)
    closed = closed_forms.deployment_speed(unwinding(WIDE)) * np.sqrt(1.0 - (SHORT - WOUND) / tail)
    speed = np.linalg.norm(np.gradient(found["rib"]["position"].values[:, -1], time, axis=0), axis=1)
    first, last = int(np.argmax(angle < 0.7)), int(np.argmax(angle < 0.15))
    released = stored[first] - stored[last]
    figures = {
        "energy released per radian, nJ": 1e9 * released / (angle[first] - angle[last]),
        "share that becomes kinetic energy": (kinetic[last] - kinetic[first]) / released,
        "tip speed over the closed form": float(np.mean(speed[first:last] / closed[first:last])),
    }
    return time, speed, closed, figures


found = run()
time, speed, closed, figures = compare(found)
for words, value in figures.items():
    print(f"{words}: {value:.4g}")
root, straight = found["rib"]["bending_moment_z"].values[:, 0], int(np.argmax(found["rib"]["fold_angle"].values < 0.0))
after = np.abs(root[straight:])
print(f"straight at {time[straight]:.1f} s; root moment then up to {1e6 * after.max():.2f} uN m, later")
print(f"{1e6 * np.median(after[time[straight:] > time[straight] + 5.0]):.3f} uN m, that of a fold on the other side")

# %%
# The energy of a radian is :math:`w R`. Elements that snap one by one vibrate, and damping takes that part: the finer
# the mesh, the closer is the tip speed to the closed form (0.94 of it here, 0.90 with 100 elements). The clamp does
# not stop the rib. Its moment exceeds that at which the section snaps while the walls flatten; then the root folds
# and the rib rotates on.

figure, (bent, fast, clamp) = plt.subplots(1, 3, figsize=(11.0, 3.6), layout="constrained")
curvature = np.geomspace(1e-3, 10.0, 400)
for name, section in (("plain", PLAIN), ("wide lens", WIDE), ("narrow lens", NARROW)):
    bent.loglog(curvature, 1e6 * law(section, curvature)[0], label=name)
bent.axvline(1.0 / HUB, color="gray", linewidth=0.8, linestyle="--", label="hub")
bent.set(xlabel="curvature [1/m]", ylabel="moment [uN m]", title="sections", ylim=(1e-4, 1e3))
bent.legend(loc="upper left")
unwound = time <= time[straight]
fast.plot(time[unwound], 1e3 * speed[unwound], label="run")
fast.plot(time[unwound], 1e3 * closed[unwound], "k--", label="closed form")
fast.set(xlabel="time [s]", ylabel="tip speed [mm/s]", title="wide lens, 0.6 m")
fast.legend()
clamp.plot(time, 1e6 * root)
limit = table["wide lens"]["snaps at, uN m"]
for sign in (-1.0, 1.0):
    clamp.axhline(sign * limit, color="gray", linewidth=0.8, linestyle="--")
clamp.set(xlabel="time [s]", ylabel="root moment [uN m]", title="dashed: the section snaps")
plt.show()
