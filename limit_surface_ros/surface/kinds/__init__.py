"""The kinds of limit surface."""
