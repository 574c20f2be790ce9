"""From parts to flat arrays: references, records, families and the functions that they need."""
