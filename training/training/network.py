"""The network: a backbone for template and window, and a head that compares the two.

Only operators that the tracker's runtime allows are used, and no batch norm is left once each is
folded into its convolution.
"""

import torch
from torch import nn

from .geometry import STRIDE

# Sides of the maps of features, in cells.
KERNEL = 8


def convolution(inputs, outputs, kernel=3, stride=1, groups=1, active=True):
    layers = [
        nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, groups=groups, bias=False),
        nn.BatchNorm2d(outputs),
    ]
    return nn.Sequential(*layers, *([nn.ReLU(inplace=True)] if active else []))


class Residual(nn.Module):
    """An inverted residual (Sandler et al. 2018)."""

    def __init__(self, inputs, outputs, stride=1, kernel=3):
        super().__init__()
        wide = 2 * inputs
        self.layers = nn.Sequential(
            convolution(inputs, wide, 1),
            convolution(wide, wide, kernel, stride, wide),
            convolution(wide, outputs, 1, active=False),
        )
        self.added = stride == 1 and inputs == outputs

    def forward(self, features):
        made = self.layers(features)
        return features + made if self.added else made


class Backbone(nn.Module):
    """Features of a picture (0 to 255) at one eighth of its resolution."""

    def __init__(self, widths):
        super().__init__()
        first, second, third = widths
        self.layers = nn.Sequential(
            convolution(3, first, 3, 2),
            convolution(first, first, 3, 2, first),
            convolution(first, second, 1, active=False),
            Residual(second, second),
            Residual(second, third, 2, 5),
            Residual(third, third, kernel=5),
            Residual(third, third, kernel=3),
        )

    def forward(self, picture):
        return self.layers((picture - 127.5) * (1 / 64))


def unit(features):
    """Each cell's features, scaled to length 1."""
    square = (features * features).mean(1, keepdim=True) * features.shape[1]
    return features / torch.sqrt(square + 1e-6)


def tower(width):
    """Two depthwise separable convolutions."""
    layers = []
    for _ in range(2):
        layers += [convolution(width, width, 5, 1, width), convolution(width, width, 1)]
    return nn.Sequential(*layers)


class Head(nn.Module):
    """Whether the target is at each cell, and the distances from there to the sides of its box."""

    def __init__(self, features, width):
        super().__init__()
        self.of_template = nn.Conv2d(features, features, 1)
        self.of_window = nn.Conv2d(features, features, 1)
        self.likeness = convolution(KERNEL * KERNEL, width, 1, active=False)
        self.product = convolution(features, width, 1, active=False)
        self.plain = convolution(features, width, 1, active=False)
        self.gate = nn.Conv2d(features, width, 1)
        self.classes, self.boxes = tower(width), tower(width)
        self.score = nn.Conv2d(width, 1, 3, padding=1)
        self.sides = nn.Conv2d(width, 4, 3, padding=1)
        nn.init.constant_(self.score.bias, -3.5)
        nn.init.normal_(self.sides.weight, 0, 0.01)
        nn.init.constant_(self.sides.bias, 0.7)

    def forward(self, template, window):
        template, window = self.of_template(template), self.of_window(window)
        batch, channels, rows, columns = window.shape
        kernel = unit(template).reshape(batch, channels, KERNEL * KERNEL).transpose(1, 2)
        likeness = kernel @ unit(window).reshape(batch, channels, rows * columns)
        likeness = likeness.reshape(batch, KERNEL * KERNEL, rows, columns)
        target = template[:, :, 2:6, 2:6].mean((2, 3), keepdim=True)
        seen = self.plain(window) * torch.sigmoid(self.gate(target))
        mixed = torch.relu(self.likeness(likeness) + self.product(window * target) + seen)
        sides = torch.exp(torch.clamp(self.sides(self.boxes(mixed)), -3, 3)) * STRIDE
        return self.score(self.classes(mixed)), sides


class Tracker(nn.Module):
    """Backbone and head. Outputs: a logit a cell; left, top, right, bottom in window pixels."""

    def __init__(self, widths=(16, 24, 64), head=48):
        super().__init__()
        self.backbone = Backbone(widths)
        self.head = Head(widths[2], head)

    def forward(self, template, window):
        return self.head(self.backbone(template), self.backbone(window))


def multiply_adds(network, template, window):
    """Multiply-adds of a frame: the backbone over the window, and the head."""
    count = [0]

    def add(module, _, output):
        kernel = module.kernel_size[0] * module.kernel_size[1]
        count[0] += output[0].numel() * module.in_channels // module.groups * kernel

    hooks = [
        module.register_forward_hook(add)
        for module in network.modules()
        if isinstance(module, nn.Conv2d)
    ]
    with torch.no_grad():
        features = network.backbone(template)
        count[0] = 0
        seen = network.backbone(window)
        network.head(features, seen)
    for hook in hooks:
        hook.remove()
    return count[0] + seen[0].numel() * KERNEL * KERNEL
