"""Writes the network as two ONNX files, laid out as those of NanoTrack."""

import copy

import onnx
import torch
from onnx import numpy_helper

from .geometry import CELLS, SEARCH
from .network import KERNEL, Tracker

OPSET = 17
FILES = ("patchnet_backbone.onnx", "patchnet_head.onnx")


def network_of(path):
    """The network with the weights of a file."""
    network = Tracker()
    network.load_state_dict(torch.load(path, weights_only=True))
    return network.eval()


def export(network, folder):
    """Writes the files of `FILES`."""
    folder.mkdir(parents=True, exist_ok=True)
    network = copy.deepcopy(network).eval().to(memory_format=torch.contiguous_format)
    picture = torch.zeros(1, 3, SEARCH, SEARCH)
    features = network.backbone(picture)
    backbone, head = (folder / name for name in FILES)
    free = {2: "height", 3: "width"}
    write(
        network.backbone,
        (picture,),
        backbone,
        ["picture"],
        ["features"],
        {"picture": free, "features": {2: "rows", 3: "columns"}},
    )
    template = torch.zeros(1, features.shape[1], KERNEL, KERNEL)
    write(
        network.head,
        (template, torch.zeros(1, features.shape[1], CELLS, CELLS)),
        head,
        ["template", "window"],
        ["score", "sides"],
        None,
    )
    return backbone, head


def write(module, inputs, path, names, outputs, free):
    torch.onnx.export(
        module,
        inputs,
        str(path),
        input_names=names,
        output_names=outputs,
        dynamic_axes=free,
        opset_version=OPSET,
        dynamo=False,
    )
    model = without_identities(onnx.load(path))
    onnx.checker.check_model(model)
    onnx.save(model, path)


def without_identities(model):
    """The model with a copy of a tensor where one stood for two: the tracker's runtime does not
    allow that operator."""
    graph = model.graph
    tensors = {tensor.name: tensor for tensor in graph.initializer}
    for node in [node for node in graph.node if node.op_type == "Identity"]:
        copied = numpy_helper.from_array(
            numpy_helper.to_array(tensors[node.input[0]]), node.output[0]
        )
        tensors[copied.name] = copied
        graph.initializer.append(copied)
        graph.node.remove(node)
    return model

