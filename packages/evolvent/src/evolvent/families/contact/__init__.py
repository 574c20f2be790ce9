"""Contact of beams, rods and bodies with surfaces and with one another."""
