"""The search for values with which a result is best: Optuna proposes rounds of trials, and each round is played as one batch."""
