"""Other people's solvers on the same scenes, each run by a script that an environment of its own executes."""
