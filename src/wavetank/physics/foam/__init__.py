"""Spray, foam and bubbles: passive particles that moving water makes, after Ihmsen et al. 2012."""
