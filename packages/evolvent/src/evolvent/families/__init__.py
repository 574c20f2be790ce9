"""The families of parts: one module a topic, found by being here (`evolvent.model.registry`)."""
