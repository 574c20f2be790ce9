"""Contact of beams, rods, shells and bodies with surfaces and with one another."""
