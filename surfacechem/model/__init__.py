"""A scene becomes equations: components, constraints and balances, assembled into one system of symbolic rows."""
