"""Fields of force on all masses."""
