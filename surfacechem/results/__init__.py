"""What a run hands over: dataset, events, balances and the error of each answer."""
