"""Model and data files to validated objects, and back."""
