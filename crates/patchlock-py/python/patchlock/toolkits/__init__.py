"""Adapters to other toolkits.

`patchlock.toolkits.cv2` has the interface of OpenCV's trackers, `patchlock.toolkits.got10k` is a tracker for
the experiments of the got10k toolkit, and `patchlock.toolkits.vot` writes the file that registers the command
`patchlock trax` with the VOT toolkit. A toolkit is imported only by its own module.
"""
