"""The claims of Belyakov (2002), inertia stand: the ledger of `evolvent claims stand`."""

from __future__ import annotations

from evolvent.papers import stand_measures as measures
from evolvent.papers.ledger import Claim

_FIGURES = (
    Claim(
        name="stand-figure-1",
        where="figure 1",
        claim="Schematic of the stand: a body on four springs, its centre of mass beside the stiffness centre.",
        verdict="holds",
        ours="Drawn from the geometry of the case, with the axes of rotation of the modes.",
        command="evolvent figure stand-figure-1",
    ),
    Claim(
        name="stand-figure-2",
        where="figure 2",
        claim="Energies of the three modes over the offset.",
        verdict="holds",
        ours="Heave, pitch, roll at 0.4 m: {heave_1:.1f}, {pitch_1:.2f}, {roll_1:.2f} J; at 0.8 m: {heave_2:.1f}, "
        "{pitch_2:.3f}, {roll_2:.2f} J.",
        values={
            "heave_1": 30.2085, "pitch_1": 2.27031, "roll_1": 16.2395,
            "heave_2": 32.3071, "pitch_2": 0.171197, "roll_2": 16.2395,
        },
        tolerance=0.005,
        measure=measures.energies,
        seconds=2,
        command="evolvent figure stand-figure-2",
    ),
    Claim(
        name="stand-figure-3",
        where="figure 3",
        claim="Amplitudes of each mode at each spring over the offset.",
        verdict="holds",
        ours="At the loaded spring with 0.4 m: heave {heave:.2f}, pitch {pitch:.3f}, roll {roll:.2f} mm.",
        values={"heave": 6.16083, "pitch": 0.463019, "roll": 3.31194},
        tolerance=0.005,
        measure=measures.amplitudes,
        command="evolvent figure stand-figure-3",
    ),
    Claim(
        name="stand-figure-4",
        where="figure 4",
        claim="Map of the smallest mode energy over the plane of offsets, 999 points.",
        verdict="holds",
        ours="Of the {points:.0f} points in the box of 20 % of the spacing, {below:.0f} % lie below 1 % of the "
        "energy at the middle; least {least:.2g} J, median {median:.1f} J. With the best of the four springs "
        "loaded: least {best_least:.2f} J, median {best_median:.1f} J.",
        values={
            "points": 425.0, "least": 1.28815e-05, "median": 2.7199, "below": 13.4118, "best_least": 0.171386,
            "best_median": 7.04244,
        },
        measure=measures.least_energies,
        command="evolvent figure stand-figure-4",
    ),
    Claim(
        name="stand-figure-5",
        where="figure 5",
        claim="Frequencies over the x offset: heave falls, pitch rises, roll stays at 24.59 rad/s.",
        verdict="holds",
        paper="24.59 rad/s",
        ours="Heave {heave_0:.3f}, {heave_4:.3f}, {heave_8:.3f} rad/s at 0, 0.4, 0.8 m; pitch {pitch_0:.3f}, "
        "{pitch_4:.3f}, {pitch_8:.3f}; roll {roll_0:.3f}, {roll_4:.3f}, {roll_8:.3f}.",
        values={
            "heave_0": 13.9618, "pitch_0": 16.4217, "roll_0": 24.5901, "heave_4": 13.2285, "pitch_4": 17.3318,
            "roll_4": 24.5898, "heave_8": 12.0355, "pitch_8": 19.0491, "roll_8": 24.5890,
        },
        tolerance=2e-5,
        measure=measures.frequencies,
        command="evolvent figure stand-figure-5",
    ),
)  # fmt: skip

_THEORY = (
    Claim(
        name="stand-motion",
        where="equations of motion",
        claim="Full geometry without an assumption of small angles; springs act along the line between their ends.",
        verdict="holds",
        ours="The model is the same. Where spring 1 moves by {move:.1f} mm, frequencies differ from the linear "
        "model's by up to {ppm:.0f} ppm.",
        values={"ppm": 3.9475, "move": 9.93581},
        tolerance=0.05,
        measure=measures.swing,
        command="evolvent run inertia-stand",
    ),
    Claim(
        name="stand-mode-energy",
        where="formula for the energy of a mode",
        claim="A mode has the energy (k/2) times the sum of the squares of its amplitudes at the springs.",
        verdict="holds",
        ours="The energies sum to 3 F^2/8k = {closed:.2f} J at every offset: {middle:.2f} J at the middle, "
        "{aside:.2f} J at 0.4 m.",
        values={"middle": 48.7185, "aside": 48.7183, "closed": 48.7185},
        tolerance=1e-4,
        measure=measures.sum_of_energies,
        command="evolvent figure stand-figure-2",
    ),
    Claim(
        name="stand-one-knock",
        where="text on the method",
        claim="One load that is released suddenly sets all three modes in motion.",
        verdict="in part",
        ours="A mode whose axis of rotation passes through the loaded spring gets nothing: pitch at an x offset of "
        "sqrt(a^2 - Izz/M) = {at:.3f} m, and along curves that cross the plane.",
        values={"at": 1.052912},
        tolerance=1e-5,
        measure=measures.no_pitch,
        command="evolvent figure stand-figure-4",
    ),
    Claim(
        name="stand-partial-frequencies",
        where="text on the inverse problem",
        claim="The partial frequencies of heave, roll and pitch follow from k, M, the moments, a and b.",
        verdict="holds",
        ours="sqrt(4k/M) = {heave:.3f}, sqrt(4k b^2/Ixx) = {roll:.3f}, sqrt(4k a^2/Izz) = {pitch:.3f} rad/s.",
        values={"heave": 13.9618, "roll": 24.5902, "pitch": 16.4217},
        tolerance=1e-5,
        measure=measures.partial_frequencies,
        command="evolvent run inertia-stand",
    ),
    Claim(
        name="stand-three-frequencies",
        where="text on the inverse problem",
        claim="Three frequencies, the mass and the centre of mass give the moments; the stiffness is not needed.",
        verdict="in part",
        ours="The stiffness cancels, but {count:.0f} bodies have the same three frequencies at (0.4, 0.174) m. "
        "One of them has a stiffness only {stiffness:.3f} % off and Ixx = {Ixx:.0f}, Izz = {Izz:.0f} kg m2: "
        "mode shapes must decide.",
        values={"count": 6.0, "stiffness": 0.00547652, "Ixx": 8304.44, "Izz": 19587.4},
        measure=measures.candidates,
        command="evolvent run inertia-stand --set identification.way=three-frequencies",
    ),
    Claim(
        name="stand-axes",
        where="text on the axes of rotation",
        claim="The axes of rotation lie between the centre of mass and the centre of stiffness, nearer to the "
        "centre of mass for soft springs.",
        verdict="refuted",
        ours="They lie beyond the centre of mass, by {pitch:.2f} ex = ex/(M a^2/Izz - 1) of pitch and "
        "{roll:.2f} ez = ez/(M b^2/Ixx - 1) of roll, whatever the stiffness. With the centre of mass at 0.4 m "
        "the axis of pitch is at {at:.3f} m.",
        values={"pitch": 2.60808, "roll": 0.475735, "at": 1.13932},
        tolerance=1e-4,
        measure=measures.axes,
        command="evolvent figure stand-figure-1",
    ),
    Claim(
        name="stand-tilt",
        where="text on the inverse problem",
        claim="The body is taken as level at rest.",
        verdict="in part",
        ours="At a corner of the box of 20 % the static tilt makes Ixx {Ixx:.3f} % too large; the fit at the "
        "tilted equilibrium is free of it.",
        values={"Ixx": 0.0650688},
        measure=measures.tilt,
        command="evolvent figure stand-error",
    ),
    Claim(
        name="stand-product",
        where="data",
        claim="The data are principal moments along the axes of the stand (Ixz = 0).",
        verdict="in part",
        ours="Turned by 1 degree about the vertical, the body gives an Izz that is {Izz:.1f} % off; `shapes` "
        "and `fit` find Ixz.",
        values={"Izz": 2.57568},
        measure=measures.product,
    ),
    Claim(
        name="stand-height",
        where="text on the linear model",
        claim="The linear model has neither gravity nor the height of the attachment plane.",
        verdict="in part",
        ours="With the plane 0.1 m above the centre of mass the roll's frequency is {roll:.2f} % higher.",
        values={"roll": 0.394127},
        measure=measures.height,
    ),
)

_SIMULATION = (
    Claim(
        name="stand-scheme-order",
        where="text on the scheme",
        claim="The order of the scheme on the harmonic oscillator lies between 2 and 3.",
        verdict="in part",
        paper="2 to 3",
        ours="The frequency has the order {frequency:.2f}: it is low by (w dt)^2/48, {lag:.0f} ppm at 80 steps "
        "a period. Only the displacement at whole periods has the order 3, the velocity there has 2.",
        values={"frequency": 1.99661, "lag": 128.109, "theory": 128.510},
        tolerance=1e-4,
        measure=measures.scheme_order,
    ),
    Claim(
        name="stand-roll-frequency",
        where="text on the frequencies",
        claim="The roll has 24.59 rad/s.",
        verdict="in part",
        paper="24.59 rad/s",
        ours="Half the body's diameter as b gives {linear:.4f} rad/s; a step of 6 ms makes {stepped:.4f} of it.",
        values={"linear": 24.6015, "stepped": 24.5905},
        tolerance=1e-5,
        measure=measures.roll_frequency,
        command="evolvent run inertia-stand-paper",
    ),
    Claim(
        name="stand-step-6",
        where="step 6 of the scheme",
        claim="The inertia tensor is turned into the fixed frame.",
        verdict="open",
        ours="Turned by the rotation, as ours, it is right. Turned by the inverse (S^T I S beside r = S r) it "
        "would shift frequencies by 1e-4 to 3e-4; which one the paper ran is not known.",
    ),
    Claim(
        name="stand-step-7",
        where="step 7 of the scheme",
        claim="The angular acceleration follows from a linear system without the gyroscopic term.",
        verdict="in part",
        ours="The term is missing in print. Without it frequencies shift by up to 1e-5 of themselves; ours has it.",
    ),
    Claim(
        name="stand-limiters",
        where="text on limiters",
        claim="The stand needs limiters that hold the body sideways.",
        verdict="in part",
        ours="A body that stands on pinned springs leaves the upright by a factor e every {time:.3f} s and "
        "falls within about 2 s. One that hangs needs none: sway {lateral:.2f} rad/s, yaw {yaw:.2f} rad/s.",
        values={"time": 0.166963, "lateral": 4.22141, "yaw": 5.41421},
        tolerance=1e-4,
        measure=measures.upright_instability,
        command="evolvent run inertia-stand --set stand.support=standing",
    ),
    Claim(
        name="stand-simulate-first",
        where="text on the purpose",
        claim="The stand is simulated before it is built, to find the offsets that it allows.",
        verdict="holds",
        ours="Here a = 2 m is near sqrt(Izz/M) = 1.70 m: the weakest mode falls to 5 % of its energy at an "
        "offset of {a:.1f} % of the spacing, with a = 2.5 m at {longer:.1f} %.",
        values={"a": 14.6, "longer": 23.74},
        tolerance=1e-3,
        measure=measures.first_lost,
        command="evolvent sweep inertia-stand-map",
    ),
    Claim(
        name="stand-safe-offset",
        where="text on figure 4",
        claim="Three modes stay identifiable while the offset is within about 20 % of the spacing along each axis.",
        verdict="in part",
        paper="20 %",
        ours="Curves of zero energy cross that box; {below:.0f} % of it has less than 1 % of the energy at the "
        "middle. Loading the best spring leaves at least {best_least:.2f} J everywhere.",
        values={
            "points": 425.0, "least": 1.28815e-05, "median": 2.7199, "below": 13.4118, "best_least": 0.171386,
            "best_median": 7.04244,
        },
        measure=measures.least_energies,
        command="evolvent figure stand-figure-4",
    ),
    Claim(
        name="stand-map-time",
        where="text on figure 4",
        claim="999 points of the map took 20 hours on a processor of 160 MHz.",
        verdict="open",
        paper="20 h",
        ours="Not repeatable on that processor. The motion of all 999 cases, 12.24 s each, takes about 0.5 s on "
        "one core by DOP853; the map with identification takes about 2 min on two.",
        command="evolvent sweep inertia-stand-map",
    ),
)  # fmt: skip

_IDENTIFICATION = (
    Claim(
        name="stand-signals",
        where="text on the method",
        claim="Four sensors at the springs give frequencies, decay rates and amplitudes of the modes.",
        verdict="holds",
        ours="Identified from the simulated signals they are those of the linear model (circles in figures 2, 3 "
        "and 5).",
        command="evolvent figure stand-figure-3",
    ),
    Claim(
        name="stand-prony-model",
        where="text on Prony's method",
        claim="A constant and P damped cosines obey a linear prediction of order 2 P + 1, whose roots are the poles.",
        verdict="holds",
        ours="Without noise the frequencies are right within {ppm:g} ppm.",
        values={"ppm": 0.001},
        measure=measures.prony_exact,
        command="evolvent run inertia-stand-paper",
    ),
    Claim(
        name="stand-prony-accuracy",
        where="text on Prony's method",
        claim="Frequencies from 100 samples are accurate to 0.001 %.",
        verdict="refuted",
        paper="0.001 %",
        ours="With 1 % noise and one sensor: {p21:.3f}, {p24:.3f}, {p27:.3f}, {p30:.3f}, {p40:.2f}, {p60:.0f}, "
        "{p90:.0f} % at 2.1, 2.4, 2.7, 3, 4, 6, 9 samples a period. VARPRO at 2.5: {varpro:.4f} %.",
        values={
            "p21": 0.0505664,
            "p24": 0.0223994,
            "p27": 0.0228651,
            "p30": 0.0656875,
            "p40": 0.290493,
            "p60": 49.9116,
            "p90": 257.381,
            "varpro": 0.00353718,
        },
        tolerance={"p60": 0.2, "p90": 0.05},
        measure=measures.prony,
        seconds=2,
        command="evolvent figure stand-prony",
    ),
    Claim(
        name="stand-prony-rules",
        where="rules 2.5 and 2.6",
        claim="Rules for the choice of the samples that Prony's method takes.",
        verdict="open",
        ours="Their text is not at hand. The error has its minimum at {best:.1f} samples a period of the "
        "highest mode, {error:.3f} %, and stays within 20 % of it from 2.4 to 2.7.",
        values={"best": 2.5, "error": 0.0199916},
        measure=measures.prony_best,
        command="evolvent figure stand-prony",
    ),
    Claim(
        name="stand-accuracy",
        where="text on the accuracy",
        claim="The moments are found within 0.1 %.",
        verdict="in part",
        paper="0.1 %",
        ours="By the paper's method Ixx is off by up to {Ixx:.2f} %, Izz by up to {Izz:.2f} %, without noise. "
        "Most of it is the step of 6 ms, which gives {step_Ixx:.3f} and {step_Izz:.3f} % without offset.",
        values={"Ixx": 0.111695, "Izz": 0.0372221, "step_Ixx": 0.0615454, "step_Izz": 0.0112112},
        measure=measures.paper_accuracy,
        seconds=3,
        command="evolvent figure stand-error",
    ),
    Claim(
        name="stand-pendulum",
        where="text on other methods",
        claim="The stand is better than the pendulum method, whose moment is a difference of near-equal numbers.",
        verdict="in part",
        ours="With the same inputs the stand has standard uncertainties of {stand_xx:.2f} % of Ixx and "
        "{stand_zz:.2f} % of Izz, a pendulum with its pivot at 2 m {pendulum_xx:.2f} and {pendulum_zz:.2f} %: "
        "the stand wins for the small moment only.",
        values={"stand_xx": 0.112828, "stand_zz": 0.143737, "pendulum_xx": 0.519620, "pendulum_zz": 0.0525754},
        measure=measures.beside_pendulum,
    ),
)

CLAIMS: tuple[Claim, ...] = (*_FIGURES, *_THEORY, *_SIMULATION, *_IDENTIFICATION)
