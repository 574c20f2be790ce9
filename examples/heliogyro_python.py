"""Run a built-in case from Python, with other values and a law of one's own, and read the results."""

import evolvent


@evolvent.feed_law
def half_then_full(t, parameters):
    """Half the rate up to the time given, then the full rate, joined by a straight ramp of 2 s."""
    rate, time = parameters
    if t < time:
        return 0.5 * rate * t, 0.5 * rate, 0.0
    s = min(t - time, 2.0)
    angle = 0.5 * rate * t + 0.125 * rate * s * s + 0.5 * rate * max(t - time - 2.0, 0.0)
    return angle, 0.5 * rate + 0.25 * rate * s, 0.25 * rate if s < 2.0 else 0.0


def main() -> None:
    """Compare the tip's lag under a constant feed and under a law."""
    quick = {"blade.segments": "inextensible", "solver.method": "dopri5", "solver.duration": "20 s"}
    constant = evolvent.run("heliogyro", quick)
    law = evolvent.run("heliogyro", quick, laws={"feed": (half_then_full, (3.5, 10.0))})
    for name, run in (("constant feed", constant), ("half, then full", law)):
        rate = float(run.body_rate[-1])
        lag = float(run.lag_angle.sel(node=1, blade=1).sel(time=slice(15.0, 20.0)).max())
        length = float(run.deployed_length[-1, 0])
        print(f"{name:16}  {length:.3f} m out, body rate {rate:.4f} rad/s, largest lag of the tip {lag:.4f} rad")


if __name__ == "__main__":
    main()
