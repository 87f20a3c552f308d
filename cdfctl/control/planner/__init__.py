"""Rollout plans over predicted obstacles: straight joint motions, checked by conservative advancement."""
