"""From simulation to decision: studies and calibration."""
