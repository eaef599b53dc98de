"""Many runs that answer one question: precision, stability, the rates of a mechanism."""
