"""Runs: their folders, checkpoints, exports, films of frames, single pictures, and signals that end them."""
