"""
A built-in case with a user-defined law
=======================================

Run the heliogyro from Python with other values, define a law for its spools, and compare the lag of the blades' tips.
"""

# %%
# The law of a spool returns its angle, rate and acceleration at a time. This one turns at half the rate first, then
# speeds up to the full rate within 2 s. The decorator compiles it.

import matplotlib.pyplot as plt

import evolvent


@evolvent.law
def half_then_full(t, parameters):
    """Half the rate up to the time given, then the full rate, joined by a straight ramp of 2 s."""
    rate, time = parameters
    if t < time:
        return 0.5 * rate * t, 0.5 * rate, 0.0
    s = min(t - time, 2.0)
    angle = 0.5 * rate * t + 0.125 * rate * s * s + 0.5 * rate * max(t - time - 2.0, 0.0)
    return angle, 0.5 * rate + 0.25 * rate * s, 0.25 * rate if s < 2.0 else 0.0


# %%
# Both runs use links of fixed length and the adaptive method, which is the fastest combination. The second argument
# changes keys of the case.

quick = {"blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "20 s"}
runs = {
    "constant pay-out": evolvent.run("heliogyro", quick),
    "half, then full": evolvent.run("heliogyro", quick, laws={"drive": (half_then_full, (3.5, 10.0))}),
}
for name, run in runs.items():
    rate = float(run.body_rate[-1])
    lag = float(run.tip_lag.sel(blade=1, time=slice(15.0, 20.0)).max())
    length = float(run.deployed_length[-1, 0])
    print(f"{name:16}  {length:.3f} m out, body rate {rate:.4f} rad/s, largest lag of the tip {lag:.4f} rad")

# %%
# A run is an :class:`xarray.DataTree` with one group for each part and units on every variable; xarray draws it.

figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.5), layout="constrained")
for name, run in runs.items():
    run.body_rate.plot(ax=left, label=name)
    run.tip_lag.sel(blade=1).plot(ax=right, label=name)
for axes, title in ((left, "the body slows down"), (right, "the tip of blade 1 lags")):
    axes.set_title(title)
    axes.legend()
plt.show()
