"""A system and a part for evolvent: the pantograph mast, and the tension cable."""
