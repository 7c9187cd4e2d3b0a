//! Tetrahedral linear elasticity driven by displacements of its surface.
