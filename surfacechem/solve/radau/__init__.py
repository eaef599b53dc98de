"""The compiled stepper: Radau IIA of order 5, 9 and 13 with dense output, events and ledger."""
