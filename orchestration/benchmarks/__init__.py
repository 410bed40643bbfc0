"""Speed against accuracy: work-precision charts, peers, profiles of a run."""
