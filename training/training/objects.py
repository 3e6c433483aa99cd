"""Finds things in photographs: segments that contrast with their surrounding."""

import cv2
import numpy as np

from .pictures import shrunk

# Side to which a photograph is shrunk to be cut into segments.
SEGMENTED = 480
# Scales of the segmentation (Felzenszwalb and Huttenlocher 2004) and the smallest segments.
SCALES = ((150, 60), (500, 150), (1200, 150))
SMALL = 64
MOST = 30


def hull(mask):
    """The convex hull of a mask, as points."""
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    points = cv2.convexHull(np.concatenate(contours))[:, 0]
    return points.astype(np.float32) + 0.5


def filled(mask):
    """The largest part of a mask without holes; nothing if it is ragged."""
    mask = cv2.morphologyEx(np.pad(mask, 8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8))
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    largest = max(contours, key=cv2.contourArea)
    area, around = cv2.contourArea(largest), cv2.contourArea(cv2.convexHull(largest))
    if area < 50 or area < 0.62 * around:
        return None, 0
    full = np.zeros_like(mask)
    cv2.drawContours(full, [largest], -1, 1, -1)
    return full, area / around


def candidates(image):
    """Segments with how much they look like things: value, box, mask, place of the mask."""
    lab = cv2.cvtColor(image, cv2.COLOR_RGB2LAB).astype(np.float32)
    lab = np.pad(lab, ((8, 8), (8, 8), (0, 0)), mode="edge")
    height, width = image.shape[:2]
    for scale, smallest in SCALES:
        cutter = cv2.ximgproc.segmentation.createGraphSegmentation(0.7, scale, smallest)
        labels = cutter.processImage(image)
        areas = np.bincount(labels.ravel()) / (height * width)
        for label in np.where((areas > 0.0012) & (areas < 0.2))[0]:
            mask = (labels == label).astype(np.uint8)
            x, y, w, h = cv2.boundingRect(mask)
            at_border = x < 3 or y < 3 or x + w > width - 3 or y + h > height - 3
            if at_border or w > 5 * h or h > 5 * w or min(w, h) < 8:
                continue
            full, solidity = filled(mask[y : y + h, x : x + w])
            if full is None:
                continue
            value = contrast(lab[y : y + h + 16, x : x + w + 16], full)
            if value is not None:
                distance, texture = value
                yield distance * solidity + 0.3 * texture, (x, y, w, h), full


def contrast(lab, mask):
    """Distance of a segment's mean colour from its ring, and its texture; nothing if it is like
    the ring."""
    ring = cv2.dilate(mask, np.ones((9, 9), np.uint8)) - mask
    if ring.sum() < 10 or mask.sum() < 40:
        return None
    inner = lab[mask > 0]
    distance = np.linalg.norm(inner.mean(0) - lab[ring > 0].mean(0))
    return (distance, inner.std(0).sum()) if distance >= 9 else None


def distinct(found):
    """The best candidates that do not cover the same place."""
    kept = []
    for candidate in sorted(found, key=lambda candidate: -candidate[0]):
        if all(shared(candidate[1], other[1]) <= 0.65 for other in kept):
            kept.append(candidate)
        if len(kept) == MOST:
            break
    return kept


def shared(a, b):
    across = min(a[0] + a[2], b[0] + b[2]) - max(a[0], b[0])
    down = min(a[1] + a[3], b[1] + b[3]) - max(a[1], b[1])
    both = max(across, 0) * max(down, 0)
    return both / (a[2] * a[3] + b[2] * b[3] - both)


def segments(photograph):
    """Things in a photograph: the hull in its pixels, and a small cut-out."""
    scale = min(1, SEGMENTED / max(photograph.shape[:2]))
    image = cv2.resize(photograph, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    for _, (x, y, _, _), mask in distinct(candidates(image)):
        outline = (hull(mask) + [x - 8, y - 8]) / scale
        cut = cut_out(photograph, mask, (x - 8, y - 8), scale)
        if cut is not None:
            yield outline.astype(np.float32), cut


def cut_out(photograph, mask, place, scale):
    """A segment with a soft edge, at most `SMALL` on a side."""
    # The mask may reach over the border by its padding.
    left, top = (max(0, side) for side in place)
    mask = mask[top - place[1] :, left - place[0] :]
    x, y = int(left / scale), int(top / scale)
    height, width = (int(side / scale) for side in mask.shape)
    crop = photograph[y : y + height, x : x + width]
    alpha = cv2.resize(mask * 255, crop.shape[1::-1], interpolation=cv2.INTER_LINEAR)
    alpha = cv2.GaussianBlur(alpha, (0, 0), max(0.6, 0.6 / scale))
    rows, columns = np.where(alpha > 128)
    if len(rows) < 30:
        return None
    cut = np.dstack([crop, alpha])
    cut = cut[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    cut = shrunk(cut, SMALL)
    return cut if (cut[..., 3] > 128).sum() >= 20 else None
