"""Events of users' own."""
