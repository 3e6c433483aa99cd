"""Writes the network as two ONNX files, laid out as those of NanoTrack, with weights in half
precision."""

import copy

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper

from .geometry import CELLS, SEARCH
from .network import KERNEL, Tracker

OPSET = 17
FILES = ("backbone.onnx", "head.onnx")


def network_of(path):
    """The network with the weights of a file."""
    network = Tracker()
    network.load_state_dict(torch.load(path, weights_only=True))
    return network.eval()


def export(network, folder, half=True):
    """Writes `backbone.onnx` and `head.onnx`."""
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
        half,
    )
    template = torch.zeros(1, features.shape[1], KERNEL, KERNEL)
    write(
        network.head,
        (template, torch.zeros(1, features.shape[1], CELLS, CELLS)),
        head,
        ["template", "window"],
        ["score", "sides"],
        None,
        half,
    )
    return backbone, head


def write(module, inputs, path, names, outputs, free, half):
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
    if half:
        model = halved(model)
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


def halved(model):
    """The model with its large weights stored in half precision and widened when it is loaded."""
    graph, kept, casts = model.graph, [], []
    for tensor in graph.initializer:
        values = numpy_helper.to_array(tensor)
        if tensor.data_type != TensorProto.FLOAT or values.size < 16:
            kept.append(tensor)
            continue
        stored = numpy_helper.from_array(values.astype(np.float16), tensor.name + ".half")
        kept.append(stored)
        casts.append(helper.make_node("Cast", [stored.name], [tensor.name], to=TensorProto.FLOAT))
    nodes = casts + list(graph.node)
    del graph.initializer[:], graph.node[:]
    graph.initializer.extend(kept)
    graph.node.extend(nodes)
    return model
