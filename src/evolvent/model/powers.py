"""Powers and energies that the residual of an interval leaves behind."""

#: What forces add to `Interval.powers`: powers dissipated (W), power of loads at markers (W), energies of coordinates,
#: penalties (J), the power of motors and of what turns driven bodies, and that of spools (W).
MASS_DAMPING, STIFFNESS_DAMPING, SPRINGS, JOINTS, MARKER_LOADS, COUPLED_ENERGY, DRIVEN, SPOOLS, N_POWERS = range(9)
