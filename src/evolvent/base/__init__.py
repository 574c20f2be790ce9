"""What every other module may use: errors, units, schema, files."""
