"""Motors and their drivetrains."""
