"""What to command: constraint rows, the quadratic program that honours them, and the controller that joins both."""
