"""Relaxation: Prony terms of viscoelastic materials, and the strains of their branches."""
