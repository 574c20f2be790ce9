"""
A spacecraft simulator drives a model
=====================================

A controller outside the model turns a free hub that carries a flexible rib. It reads the hub's attitude and rate, sets
a torque, and asks for the next step: `evolvent.Stepper`.
"""

# %%
# The model: a hub of 5 kg m² with a rib of 2 m clamped to it.

import matplotlib.pyplot as plt
import numpy as np

from evolvent import Stepper, System, elements, parts

system = System()
system.add(parts.RigidBody(mass=20.0, inertia=5.0), "hub")
rib = parts.Beam(
    length=2.0,
    section=elements.Rectangle(thickness=0.01, width=0.02),
    material=elements.Material(young_modulus=2e8, poisson_ratio=0.3, density=1000.0),
    elements=6,
    formulation="cable",
    position=(0.5, 0.0, 0.0),
    stiffness_damping=0.01,
)
system.add(rib, "rib")
joint = system.add(parts.Joint(a=("hub", (0.5, 0.0, 0.0)), b="rib.root", type="clamp"), "root")

# %%
# The controller: a turn by 30 degrees about z in 60 s, proportional to the error of angle and rate, ten times a second.
# The torque is held between.

goal, proportional, derivative, every = np.radians(30.0), 0.4, 3.0, 0.1
stepper = Stepper(system, inputs=["hub"], until=60.0, step=0.01)
first = int(stepper.assembly.model.beams["iq"][0])
time, angle, tip = [0.0], [0.0], [0.0]
while stepper.time < 60.0 - 1e-9:
    hub = stepper.body("hub")
    turned = 2.0 * np.arctan2(hub.quaternion[3], hub.quaternion[0])
    torque = proportional * (goal - turned) - derivative * hub.rate[2]
    stepper.set_wrench("hub", torque=(0.0, 0.0, torque))
    stepper.step(every)
    hub = stepper.body("hub")
    turned = 2.0 * np.arctan2(hub.quaternion[3], hub.quaternion[0])
    end = stepper.state[first + 6 * 6 :][:3] - hub.position  # node 6 of a cable: 3 of position, 3 of slope
    time.append(stepper.time)
    angle.append(np.degrees(turned))
    tip.append(1e3 * (np.cos(turned) * end[1] - np.sin(turned) * end[0]))
print(f"after {time[-1]:.0f} s the hub is at {angle[-1]:.3f} deg; the tip bent by up to {np.abs(tip).max():.0f} mm")

figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(7.0, 5.0), layout="constrained")
above.plot(time, angle)
above.axhline(np.degrees(goal), color="0.6", linestyle="--")
above.set_ylabel("angle of the hub, deg")
below.plot(time, tip)
below.set(xlabel="time, s", ylabel="tip across the rib\nin the hub's axes, mm")
plt.show()
