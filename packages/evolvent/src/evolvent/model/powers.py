"""Powers and energies that the residual of an interval leaves behind."""

#: What forces add to `Interval.powers`: dissipated powers (W), power of loads at markers (W), energies of coordinates,
#: penalties (J), power of motors and of what turns driven bodies, that of spools, and what contacts take at a state.
#: The end of a step leaves works and losses in their places (J), and what friction takes.
MASS_DAMPING, STIFFNESS_DAMPING, SPRINGS, JOINTS, MARKER_LOADS, COUPLED_ENERGY, DRIVEN, SPOOLS, CONTACTS = range(9)
RUBBED, N_POWERS = 9, 10
