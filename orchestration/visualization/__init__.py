"""Results as pictures: plots, animations, the interactive report."""
