"""Threads on reels."""
