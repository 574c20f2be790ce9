"""Dense and sparse linear algebra, and eigenproblems."""
