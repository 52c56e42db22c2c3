"""What bodies do: how they move when they are pushed, slide and rest."""
