"""Bearings: friction by the reactions of a joint."""
