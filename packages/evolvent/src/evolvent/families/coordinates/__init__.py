"""What acts on coordinates of joints: springs with stops and latches, resistances, synchronizations."""
