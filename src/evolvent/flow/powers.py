"""Powers and energies that the implicit residual leaves behind."""

#: What `residual` writes into `powers`: powers dissipated (W), power of loads at markers (W), energies of coordinates,
#: penalties (J), the power of motors and of what turns driven bodies, and that of spools (W).
MASS_DAMPING, STIFFNESS_DAMPING, SPRINGS, JOINTS, MARKER_LOADS, COUPLED_ENERGY, DRIVEN, SPOOLS, N_POWERS = range(9)
