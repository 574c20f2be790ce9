"""Cable nets as geometry and statics: wanted surfaces, topologies, force densities, errors of the surface."""
