"""Optimization of mission values: Optuna proposes rounds of trials, and each round is played as one batch."""
