"""Decay models: memory kernel, delay system, characteristic roots, sums of exponentials."""
