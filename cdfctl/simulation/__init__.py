"""What happens: how obstacles and plant move, the rollout, the judge, and the run folder."""
