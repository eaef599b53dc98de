"""Symbolic equations of a scene, assembled from components, constraints and balances into one system of rows."""
