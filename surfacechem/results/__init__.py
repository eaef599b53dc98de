"""Results of a run: dataset, events, balances and the error of each answer."""
