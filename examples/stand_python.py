"""
Inertia of a body from how it swings
====================================

A body is let go on four springs. Four sensors with noise record its swing; frequencies and moments of inertia are
found from the signals and laid beside the true ones.
"""

# %%
# The centre of mass lies 0.2 m off the springs' middle, the sensors read with 0.1 mm of noise.

import matplotlib.pyplot as plt
import numpy as np

import evolvent

run = evolvent.run("inertia-stand", {"body.offset_x": "0.2 m", "sensors.noise": "0.1 mm"})

for k in range(3):
    print(f"mode {k + 1}: {run.mode_frequency[k]:.5f} ± {run.mode_frequency_std[k]:.5f} rad/s")
for component in run.component.values:
    true, value, std = (
        float(run[name].sel(component=component)) for name in ("inertia_true", "inertia_identified", "inertia_std")
    )
    if np.isfinite(value):
        print(f"I{component}: {value:9.2f} ± {std:.2f} kg m², true {true:9.2f}")

# %%
# The deviations printed are those that the noise of the signals makes. What an uncertain spring or a centre of mass
# adds is the business of `evolvent identify`, whose certificate names the share of each.

figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.5), layout="constrained", width_ratios=(2, 1))
seen = run.to_dataset().sel(sensor=1)
(1e3 * seen.sensor_displacement).plot(ax=left, linewidth=0.8)
left.set(ylabel="displacement, mm", title="sensor 1", xlim=(0.0, 4.0))
residual = 1e3 * (seen.sensor_displacement - seen.sensor_fitted)
right.hist(residual, bins=30, density=True)
x = np.linspace(-0.4, 0.4, 100)
right.plot(x, np.exp(-50.0 * x**2) * np.sqrt(50.0 / np.pi), color="black")
right.set(xlabel="residual, mm", title="what the modes leave, and the noise")
plt.show()
