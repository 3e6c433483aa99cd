"""Reads exported weights back into a network that can be trained on."""

import onnx
import torch
from onnx import numpy_helper
from torch import nn

from .batches import Batches
from .export import FILES

# Batches by which the norms are set.
BATCHES = 16


def begin(network, folder, work, settings):
    """Gives a network the weights of exported files.

    Their norms are folded into the convolutions. Each norm is set to what undoes it: the mean and
    deviation of the convolution's outputs are measured, which are its running figures and, but for
    the bias of the file, its shift and scale."""
    backbone, head = (convolutions(folder / name) for name in FILES)
    plain = {f"backbone.{k}": v for k, v in backbone.items()}
    plain |= {f"head.{k}": v for k, v in head.items()}
    norms = {}
    for name, module in network.named_modules():
        if isinstance(module, nn.Conv2d):
            weight, bias = plain.pop(name)
            module.weight.data.copy_(weight)
            if module.bias is None:
                norms[name] = network.get_submodule(name.rpartition(".")[0] + ".1"), bias
            else:
                module.bias.data.copy_(bias)
    for norm, bias in norms.values():
        norm.running_var.fill_(1 - norm.eps)
        norm.bias.data.copy_(bias)
    figures = measured(network, [norm for norm, _ in norms.values()], work, settings)
    for (name, (norm, bias)), (mean, variance) in zip(norms.items(), figures, strict=True):
        convolution = network.get_submodule(name)
        # A norm undoes the scale of the weights; this is that of trained ones.
        fan = convolution.weight[0].numel()
        size = convolution.weight.data.square().mean((1, 2, 3)).sqrt()
        scale = (1 / (3 * fan) + 0.06**2) ** 0.5 / size.clamp(min=1e-6)
        norm.weight.data.copy_((variance + norm.eps / scale**2).sqrt())
        norm.bias.data.copy_(bias + mean)
        convolution.weight.data.mul_(scale[:, None, None, None])
        norm.running_mean.copy_(mean * scale)
        norm.running_var.copy_(variance * scale**2)


def convolutions(path):
    """Weight and bias of each convolution of a file, by the name of its module."""
    graph, found = onnx.load(path).graph, {}
    tensors = {t.name: torch.tensor(numpy_helper.to_array(t)) for t in graph.initializer}
    for node in graph.node:
        if node.op_type == "Conv":
            parts = node.name.split("/")[1:-1]
            # A module in a sequence is named with the sequence.
            after = [*parts[1:], ""]
            kept = [a for a, b in zip(parts, after, strict=True) if not b.startswith(a + ".")]
            found[".".join(kept)] = tuple(tensors[name] for name in node.input[1:3])
    return found


@torch.no_grad()
def measured(network, norms, work, settings):
    """Mean and variance of what comes to each norm, as it would see them in training: a mean over
    passes, those of templates and those of windows."""
    sums = {norm: [0, 0, 0] for norm in norms}

    def add(norm, inputs):
        values = inputs[0].transpose(0, 1).flatten(1)
        one = values.mean(1), values.var(1), 1
        sums[norm] = [a + b for a, b in zip(sums[norm], one, strict=True)]

    hooks = [norm.register_forward_pre_hook(add) for norm in norms]
    network.eval()
    batches = Batches(work, settings.seed, settings.batch, 0, 1)
    try:
        for _ in range(BATCHES):
            templates, windows, _ = batches.take()
            network(*(p.permute(0, 3, 1, 2).float() for p in (templates, windows)))
    finally:
        batches.close()
        for hook in hooks:
            hook.remove()
    return [(mean / count, variance / count) for mean, variance, count in sums.values()]
