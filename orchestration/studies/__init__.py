"""Studies over many runs: model selection, parameter sweeps, stability maps."""
