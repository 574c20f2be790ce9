"""
A sweep: how fast may the blades be paid out?
=============================================

A study runs one case over values of any of its keys and returns one labelled dataset. Here: the rate of the spools and
their distance from the spin axis, and how far the blade's tip lags.
"""

# %%
# The same study can be a YAML file for ``evolvent sweep``. Its results can be kept in a folder, from which a stopped
# study continues, and computed on several processes (``workers=8``).

import matplotlib.pyplot as plt
import numpy as np

import evolvent

study = {
    "study": "payout",
    "case": "heliogyro",
    "set": {
        "blade.segments": "inextensible",
        "blade.nodes": 10,
        "spool.start_length": "5 mm",
        "solver.method": "dopri5",
        "solver.duration": "15 s",
        "output.every": "0.5 s",
    },
    "sample": "grid",
    "over": {
        "spool.rate": {"from": "2 rad/s", "to": "6 rad/s", "points": 5},
        "body.spool_offset": ["4 cm", "5 cm", "7 cm"],
    },
    "keep": ["tip_lag.mean", "body_rate.last", "hub_tension.max"],
}
found = evolvent.sweep(study)
print(found)

# %%
# In steady pay-out the lag at the spool has a closed form, sin(lag) = 2 v / (L0 W), with v the pay-out speed. While
# little thread is out, and W is still near its start, the mean lag of the tip should be near it.

lag = np.degrees(found.tip_lag_mean.sel(blade=1))
lag.attrs = {"long_name": "mean lag of the tip", "units": "deg"}
for offset in found["body.spool_offset"].values:
    line = lag.sel({"body.spool_offset": offset})
    (drawn,) = line.plot(marker="o", label=f"{100.0 * offset:.0f} cm")
    speed = 0.01 * found["spool.rate"].values
    closed = np.degrees(np.arcsin(2.0 * speed / (offset * 6.0)))
    plt.plot(found["spool.rate"], closed, "--", color=drawn.get_color())
plt.title("dashed: closed form for steady pay-out")
plt.legend(title="spools' offset")
plt.show()
