"""What every room stands on: errors, checked models, parameters, materials, rotations, files."""
