"""evolvent: how spacecraft structures are wound up, measured and deployed."""

__version__ = "0.1.0"
