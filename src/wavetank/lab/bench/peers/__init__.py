"""Other people's solvers on the same scene, each run by a script that its own environment executes."""
