"""The search for values with which a result is best: rounds of trials, each of which is a batch."""
