"""What to do: scenario files, their schema, their defaults, their draws. Pure data, no numerics."""
