"""Trains the small tracking network of Patchlock from free pictures."""
