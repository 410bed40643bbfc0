"""Independent solutions to compare with: the monolith of the same FMUs, a reference in scipy, the paper's Fig. 3."""
