"""What every other module may use: errors, units, schema, files."""

__version__ = "0.2.0"
