"""What the network is trained to say."""

import torch
import torch.nn.functional as F

from .geometry import CELLS, STRIDE

GRID = torch.arange(CELLS) * float(STRIDE) + STRIDE / 2
ROWS, COLUMNS = torch.meshgrid(GRID, GRID, indexing="ij")
# Shares of the parts of the loss.
BOX, SIDES, STRANGERS = 1.5, 0.5, 0.25


def targets(boxes):
    """For each cell: distances to the sides, whether it counts as the target, and whether it lies
    in the box. A box without area means that the target is absent."""
    left, top, right, bottom = (side[:, None, None] for side in boxes.unbind(1))
    distances = torch.stack([COLUMNS - left, ROWS - top, right - COLUMNS, bottom - ROWS], 1)
    there = right > left
    half = STRIDE / 2
    across = (COLUMNS - (left + right) / 2).abs() <= (0.25 * (right - left)).clamp(min=half)
    down = (ROWS - (top + bottom) / 2).abs() <= (0.25 * (bottom - top)).clamp(min=half)
    return distances, across & down & there, (distances.amin(1) > 0) & there


def area(sides):
    """The areas of boxes by the distances to their sides. A cell beside a narrow box has negative
    ones, so what two boxes share may be nothing."""
    return (sides[:, :2] + sides[:, 2:]).clamp(min=0).prod(1)


def overlaps(made, given):
    """Intersection over union, and its generalisation (Rezatofighi et al. 2019), of boxes that
    share a cell."""
    shared, around = area(torch.minimum(made, given)), area(torch.maximum(made, given))
    union = area(made) + area(given) - shared
    overlap = shared / union
    return overlap, overlap - (around - union) / around


def loss(logits, sides, boxes):
    """The loss of a batch, and the mean overlap where the target is."""
    logits, sides = logits[:, 0].float(), sides.float()
    distances, positive, inside = targets(boxes)
    made = sides.permute(0, 2, 3, 1)[positive]
    given = distances.permute(0, 2, 3, 1)[positive]
    overlap, general = overlaps(made, given)
    each = positive.flatten(1).sum(1).clamp(min=1).float()
    # Every target counts the same, however many cells it covers.
    weight = 1 / each[positive.nonzero()[:, 0]]
    batch = len(boxes)
    size = torch.sqrt((given[:, 0] + given[:, 2]) * (given[:, 1] + given[:, 3]))[:, None]
    box_loss = ((1 - general) * weight).sum() / batch
    side_loss = (((made - given).abs() / size).mean(1) * weight).sum() / batch
    class_loss = quality(logits, positive, inside, overlap.detach(), each) / batch
    total = class_loss + BOX * box_loss + SIDES * side_loss
    return total, overlap.detach().mean()


def quality(logits, positive, inside, overlap, each):
    """Focal loss with the overlap as what the score should be. Cells of the box beside its middle
    are left out."""
    wanted = torch.zeros_like(logits)
    wanted[positive] = 0.3 + 0.7 * overlap
    raw = F.binary_cross_entropy_with_logits(logits, wanted, reduction="none")
    weight = 0.6 * torch.sigmoid(logits.detach()) ** 1.5
    weight = torch.where(inside, torch.zeros_like(weight), weight)
    weight = torch.where(positive, (3 / each)[:, None, None].expand_as(weight), weight)
    return (raw * weight).sum()


def strangers(logits):
    """The loss of windows in which the template's target is not."""
    logits = logits[:, 0].float()
    weight = 0.6 * torch.sigmoid(logits.detach()) ** 1.5
    return STRANGERS * (F.softplus(logits) * weight).sum() / len(logits)
