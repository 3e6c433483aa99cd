"""Patchlock in the shape that other toolkits expect: one module a toolkit, each importing the toolkit only when it is imported itself.

`patchlock.toolkits.cv2` has OpenCV's shape of a tracker, `patchlock.toolkits.got10k` is a tracker for got10k's experiments, and
`patchlock.toolkits.vot` writes the file by which the VOT toolkit finds the command `patchlock trax`.
"""
