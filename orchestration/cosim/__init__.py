"""Co-simulation of subsystems behind one protocol.

Their coupling graph, algebraic loops, extrapolation, acceleration, step control and the master that drives them. It
knows nothing of FMUs and files.
"""
