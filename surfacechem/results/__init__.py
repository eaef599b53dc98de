"""Results of a run: dataset, events, balances and errors."""
