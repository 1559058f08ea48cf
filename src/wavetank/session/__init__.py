"""A world under a hand: commands, tools, time, game, recordings."""
