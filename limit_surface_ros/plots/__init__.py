"""Pictures; matplotlib is an optional extra and imported where it is used."""
