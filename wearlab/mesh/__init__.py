"""Flanks in quasi-static contact: stiffness, gaps, load sharing, and excitation."""
