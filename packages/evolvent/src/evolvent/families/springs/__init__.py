"""Springs between points, and users' forces between points."""
