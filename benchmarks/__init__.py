"""Measurements that need more than the package: another solver, a browser. Run them from a checkout of the repository.

python -m benchmarks.peers dam                 SPlisHSPlasH on the same dam break, taking turns (four minutes)
python -m benchmarks.peers scenes              scenes of SPlisHSPlasH by both solvers: pictures, heights over time
python -m benchmarks.browser                   the page of `wavetank play` in a headless Chromium
"""
