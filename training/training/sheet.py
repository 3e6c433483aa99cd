"""A picture of pairs, to look at what the network sees."""

import cv2
import numpy as np

from .geometry import SEARCH, TEMPLATE
from .pairs import make

ROWS, COLUMNS = 9, 8


def write(store, path, seed=1):
    """Writes a sheet of the first pairs of a seed."""
    tiles = [tile(make(store, seed, number)) for number in range(ROWS * COLUMNS)]
    rows = [np.hstack(tiles[k : k + COLUMNS]) for k in range(0, len(tiles), COLUMNS)]
    cv2.imwrite(str(path), cv2.cvtColor(np.vstack(rows), cv2.COLOR_RGB2BGR))


def tile(pair):
    """Template and window beside each other, with the box."""
    picture = np.zeros((SEARCH, TEMPLATE + SEARCH + 2, 3), np.uint8)
    picture[:TEMPLATE, :TEMPLATE] = pair.template
    window = pair.window.copy()
    if pair.box.any():
        left, top, right, bottom = (int(side) for side in pair.box)
        cv2.rectangle(window, (left, top), (right, bottom), (255, 255, 0), 1)
    picture[:, TEMPLATE + 1 : -1] = window
    return picture
