"""The families of parts: one folder a topic, whose modules are found by their names (`evolvent.model.registry`)."""
