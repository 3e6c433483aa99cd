"""network/*.onnx and network/network.json: small made-up networks, their outputs and boxes, by onnxruntime.

The networks have random weights. Their inputs, outputs, operators and structure are those of NanoTrack v3
(backbone and head) and VitTrack, with few channels and layers. They find nothing, but every operator and
every step of the loop of network.py affects the values. No published weight is in them.

Tensors and frames are made by the formulas in network.json, whole numbers first, so every language gets the
same values.
"""

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

import golden
import network

FOLDER = golden.GOLDEN_DIR / "network"
MAX_BYTES = 60_000
SAMPLES = 64
FRAMES, WIDTH, HEIGHT = 6, 96, 72
BOX = (30.0, 22.0, 25.5, 18.25)


class Graph:
    """A graph under construction. Each method adds a node and returns the name of its output."""

    def __init__(self, seed: int):
        self.rng = np.random.default_rng(seed)
        self.nodes, self.weights, self.count = [], [], 0

    def add(
        self, kind: str, *inputs: str, outputs: int = 1, name: str | None = None, **attributes
    ) -> str | list:
        names = [name] if name else [f"{kind}_{self.count}_{k}" for k in range(outputs)]
        self.count += 1
        self.nodes.append(helper.make_node(kind, list(inputs), names, f"{kind}_{self.count}", **attributes))
        return names[0] if outputs == 1 else names

    def weight(self, values: np.ndarray) -> str:
        name = f"weight_{len(self.weights)}"
        self.weights.append(numpy_helper.from_array(np.asarray(values), name))
        return name

    def random(self, *shape: int, scale: float) -> str:
        return self.weight((self.rng.standard_normal(shape) * scale).astype(np.float32))

    def constant(self, value, kind=np.int64) -> str:
        return self.add("Constant", value=numpy_helper.from_array(np.array(value, kind)))

    def number(self, value: float) -> str:
        return self.constant(value, np.float32)

    def reshape(self, x: str, *shape: int) -> str:
        return self.add("Reshape", x, self.weight(np.array(shape, np.int64)), allowzero=0)

    def conv(
        self,
        x: str,
        before: int,
        after: int,
        size=1,
        stride=1,
        pad=None,
        groups=1,
        gain=1.4,
        bias=None,
        name=None,
    ) -> str:
        """A convolution with random weights. With gain 1.4, ReLU and it keep the variance of their input."""
        scale = gain / np.sqrt(before // groups * size * size)
        weight = self.random(after, before // groups, size, size, scale=scale)
        shift = self.random(after, scale=0.2) if bias is None else self.weight(np.array(bias, np.float32))
        pad = size // 2 if pad is None else pad
        return self.slide(x, weight, shift, size=size, stride=stride, pad=pad, groups=groups, name=name)

    def slide(self, *inputs: str, size: int, stride=1, pad=0, groups=1, name=None) -> str:
        return self.add(
            "Conv",
            *inputs,
            name=name,
            dilations=[1, 1],
            group=groups,
            kernel_shape=[size, size],
            pads=[pad] * 4,
            strides=[stride, stride],
        )

    def depthwise(self, x: str, channels: int, size: int, **more) -> str:
        return self.conv(x, channels, channels, size, groups=channels, **more)

    def clip6(self, x: str) -> str:
        return self.add("Clip", x, self.number(0.0), self.number(6.0))

    def linear(self, x: str, before: int, after: int) -> str:
        product = self.add("MatMul", x, self.random(before, after, scale=before**-0.5))
        return self.add("Add", self.random(after, scale=0.2), product)

    def model(self, inputs: dict[str, list[int]], outputs: dict[str, list[int]]) -> onnx.ModelProto:
        declared = [
            [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in values.items()]
            for values in (inputs, outputs)
        ]
        graph = helper.make_graph(self.nodes, "made_up", *declared, self.weights)
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 14)], ir_version=7)
        model = onnx.shape_inference.infer_shapes(model, strict_mode=True)
        onnx.checker.check_model(model, full_check=True)
        return model


# --- NanoTrack ----------------------------------------------------------------

CHANNELS = 8


def squeeze_excite(g: Graph, x: str, channels: int) -> str:
    mean = g.reshape(g.add("GlobalAveragePool", x), 1, channels)
    half = channels // 2

    def gemm(x: str, before: int, after: int) -> str:
        weight, bias = g.random(after, before, scale=1.0), g.random(after, scale=0.5)
        return g.add("Gemm", x, weight, bias, alpha=1.0, beta=1.0, transB=1)

    hidden = g.add("Relu", gemm(mean, channels, half))
    gate = g.add("HardSigmoid", gemm(hidden, half, channels), alpha=1 / 6)
    return g.add("Mul", x, g.reshape(gate, 1, channels, 1, 1))


def block(
    g: Graph, x: str, before: int, wide: int, after: int, size: int, stride: int, act: str, squeeze: bool
) -> str:
    """A block of MobileNetV3: widen, depthwise, squeeze and excite, narrow; plus its input where possible."""
    y = g.add(act, g.conv(x, before, wide))
    y = g.depthwise(y, wide, size, stride=stride)
    y = g.add(act, squeeze_excite(g, y, wide) if squeeze else y)
    y = g.conv(y, wide, after)
    return g.add("Add", x, y) if stride == 1 and before == after else y


def backbone() -> onnx.ModelProto:
    g = Graph(1)
    x = g.add("HardSwish", g.conv("input", 3, 6, 3, stride=2, gain=0.02))
    x = g.add("Relu", g.depthwise(x, 6, 3, stride=2))
    x = g.conv(squeeze_excite(g, x, 6), 6, 6)
    x = block(g, x, 6, 10, 8, 3, 2, "Relu", squeeze=False)
    x = block(g, x, 8, 10, 8, 3, 1, "Relu", squeeze=False)
    x = block(g, x, 8, 12, 8, 5, 2, "HardSwish", squeeze=True)
    x = block(g, x, 8, 12, 8, 5, 1, "HardSwish", squeeze=True)
    g.conv(g.add("HardSwish", g.conv(x, 8, 16)), 16, CHANNELS, name="output")
    return g.model({"input": [1, 3, 255, 255]}, {"output": [1, CHANNELS, 16, 16]})


def middle_of_template(g: Graph) -> str:
    """The inner 4 x 4 of 8 x 8 cells."""
    x = "input1"
    for axis in (2, 3):
        x = g.add("Slice", x, *(g.constant([v]) for v in (2, 6, axis, 1)))
    return x


def pixelwise(g: Graph) -> str:
    """The product of each cell of the template with each of the search image; 15 x 15 cells."""
    template = g.reshape(g.conv("input1", CHANNELS, CHANNELS), 1, CHANNELS, -1)
    search = g.reshape(g.conv("input2", CHANNELS, CHANNELS), 1, CHANNELS, -1)
    product = g.add("MatMul", g.add("Transpose", template, perm=[0, 2, 1]), search)
    x = g.reshape(product, 1, -1, 16, 16)
    hidden = g.add("Relu", g.conv(g.add("GlobalAveragePool", x), 64, 4))
    x = g.add("Mul", x, g.add("Sigmoid", g.conv(hidden, 4, 64)))
    return g.conv(g.clip6(g.depthwise(x, 64, 2, pad=0, gain=0.7)), 64, CHANNELS)


def depthwise_correlation(g: Graph, middle: str) -> str:
    """The middle of the template slides over the search image, channel by channel: 15 x 15."""
    kernel = g.reshape(g.conv(middle, CHANNELS, CHANNELS), CHANNELS, 1, 4, 4)
    search = g.reshape(g.conv("input2", CHANNELS, CHANNELS, gain=0.7), 1, CHANNELS, 16, 16)
    return g.reshape(g.slide(search, kernel, size=4, pad=1, groups=CHANNELS), 1, CHANNELS, 15, 15)


def head() -> onnx.ModelProto:
    g = Graph(2)
    middle = middle_of_template(g)
    towers = []
    for _ in range(2):
        x = g.add("Concat", pixelwise(g), depthwise_correlation(g, middle), axis=1)
        x = g.conv(x, 2 * CHANNELS, CHANNELS)
        for _ in range(2):
            x = g.conv(g.clip6(g.depthwise(x, CHANNELS, 3)), CHANNELS, CHANNELS)
        towers.append(x)
    g.conv(towers[0], CHANNELS, 2, gain=3.0, bias=[0.5, -0.5], name="output1")
    g.add("Exp", g.conv(towers[1], CHANNELS, 4, gain=0.5, bias=[3.6, 3.4, 3.5, 3.3]), name="output2")
    return g.model(
        {"input1": [1, CHANNELS, 8, 8], "input2": [1, CHANNELS, 16, 16]},
        {"output1": [1, 2, 15, 15], "output2": [1, 4, 15, 15]},
    )


# --- VitTrack -----------------------------------------------------------------

WIDTH_OF_TOKEN, TEMPLATE_TOKENS, SEARCH_TOKENS = 10, 64, 256
TOKENS = TEMPLATE_TOKENS + SEARCH_TOKENS


def tokens(g: Graph, x: str) -> str:
    """An image as tokens, one per 16 x 16 pixels, with their positions."""
    count = TEMPLATE_TOKENS if x == "template" else SEARCH_TOKENS
    for before, after in [(3, 3), (3, 6), (6, 8)]:
        x = g.add("HardSwish", g.conv(x, before, after, 3, stride=2))
    x = g.conv(x, 8, WIDTH_OF_TOKEN, 3, stride=2)
    shape = g.add("Slice", g.add("Shape", x), *(g.constant(v) for v in ([0], [2], [0])))
    x = g.add("Reshape", x, g.add("Concat", shape, g.constant([-1]), axis=0), allowzero=0)
    return g.add("Add", g.add("Transpose", x, perm=[0, 2, 1]), g.random(1, count, WIDTH_OF_TOKEN, scale=0.5))


def normalise(g: Graph, x: str) -> str:
    """Layer normalisation in single steps."""
    difference = g.add("Sub", x, g.add("ReduceMean", x, axes=[-1]))
    square = g.add("Pow", g.add("Cast", difference, to=TensorProto.FLOAT), g.number(2.0))
    variance = g.add("Add", g.add("ReduceMean", square, axes=[-1]), g.number(1e-5))
    unit = g.add("Div", difference, g.add("Sqrt", variance))
    scaled = g.add("Mul", unit, g.random(WIDTH_OF_TOKEN, scale=1.0))
    return g.add("Add", scaled, g.random(WIDTH_OF_TOKEN, scale=0.3))


def attention(g: Graph, x: str) -> str:
    size = WIDTH_OF_TOKEN
    x = g.reshape(g.linear(x, size, 3 * size), 1, TOKENS, 3, 1, size)
    x = g.add("Transpose", x, perm=[2, 0, 3, 1, 4])
    parts = g.add("Split", x, g.constant([1, 1, 1]), outputs=3, axis=0)
    query, key, value = (g.add("Squeeze", part, g.constant([0])) for part in parts)
    query = g.add("Mul", query, g.number(size**-0.5))
    weights = g.add("Softmax", g.add("MatMul", query, g.add("Transpose", key, perm=[0, 1, 3, 2])), axis=-1)
    x = g.add("Transpose", g.add("MatMul", weights, value), perm=[0, 2, 1, 3])
    return g.linear(g.reshape(x, 1, TOKENS, size), size, size)


def perceptron(g: Graph, x: str) -> str:
    """Two layers and GELU by the error function."""
    x = g.linear(x, WIDTH_OF_TOKEN, 2 * WIDTH_OF_TOKEN)
    bell = g.add("Add", g.add("Erf", g.add("Div", x, g.number(2**0.5))), g.number(1.0))
    x = g.add("Mul", g.add("Mul", x, bell), g.number(0.5))
    return g.linear(x, 2 * WIDTH_OF_TOKEN, WIDTH_OF_TOKEN)


def branch(g: Graph, x: str) -> str:
    for before, after in [(WIDTH_OF_TOKEN, 6), (6, 4)]:
        x = g.add("Relu", g.conv(x, before, after, 3))
    return x


def unit_interval(g: Graph, x: str, name: str) -> str:
    ends = (g.weight(np.array(v, np.float32)) for v in (1e-4, 1 - 1e-4))
    return g.add("Clip", g.add("Sigmoid", x), *ends, name=name)


def vittrack() -> onnx.ModelProto:
    g = Graph(3)
    x = g.add("Concat", tokens(g, "template"), tokens(g, "search"), axis=1)
    x = g.add("Add", x, attention(g, normalise(g, x)))
    x = g.add("Add", x, perceptron(g, normalise(g, x)))
    cut = (g.constant(v) for v in ([-SEARCH_TOKENS], [2**63 - 1], [1], [1]))
    x = g.add("Unsqueeze", g.add("Slice", normalise(g, x), *cut), g.constant([-1]))
    x = g.reshape(g.add("Transpose", x, perm=[0, 3, 2, 1]), -1, WIDTH_OF_TOKEN, 16, 16)
    unit_interval(g, g.conv(branch(g, x), 4, 1, gain=2.0, bias=[-0.7]), "output1")
    unit_interval(g, g.conv(branch(g, x), 4, 2, gain=0.3, bias=[-1.1, -1.3]), "output2")
    g.conv(branch(g, x), 4, 2, bias=[0.5, 0.3], name="output3")
    return g.model(
        {"template": [1, 3, 128, 128], "search": [1, 3, 256, 256]},
        {"output1": [1, 1, 16, 16], "output2": [1, 2, 16, 16], "output3": [1, 2, 16, 16]},
    )


# --- Golden values ------------------------------------------------------------


def ramp(*shape: int, scale: float, offset: float) -> np.ndarray:
    _, c, y, x = np.indices(shape)
    return (((31 * c + 7 * y + 13 * x) % 256) * scale + offset).astype(np.float32)


def frame(k: int) -> np.ndarray:
    """Blocks of 11 x 9 pixels that move by (-3, -2) per frame, on a fine texture."""
    y, x, c = np.indices((HEIGHT, WIDTH, 3))
    column, row = (x + 3 * k) // 11, (y + 2 * k) // 9
    level = (7 * column * column + 5 * row * row + 3 * column * row + 2 * c) % 8
    return (level * 25 + (x + 2 * y) % 9 * 6).astype(np.uint8)


def call(name: str, inputs: dict[str, list[int]], scale: float, offset: float) -> dict:
    """The outputs of a network, each as its shape, its sum and samples spread evenly over the flat tensor."""
    net = network.session(FOLDER / name, free_size="backbone" in name)
    tensors = {key: ramp(*shape, scale=scale, offset=offset) for key, shape in inputs.items()}
    outputs = []
    for output, values in zip(net.get_outputs(), net.run(None, tensors)):
        assert np.isfinite(values).all() and values.std() > 0.01, f"{name} {output.name} is degenerate"
        flat = values.astype(np.float64).ravel()
        chosen = np.arange(SAMPLES) * flat.size // SAMPLES
        outputs.append(
            {
                "name": output.name,
                "shape": list(values.shape),
                "sum": golden.f64s(flat.sum(), 9),
                "samples": golden.f64s(flat[chosen], 9),
            }
        )
    return {"network": name, "inputs": inputs, "scale": scale, "offset": offset, "outputs": outputs}


def track(*names: str) -> dict:
    tracker = network.load([FOLDER / name for name in names])
    tracker.start(frame(0), BOX)
    boxes, scores = [], []
    for k in range(1, FRAMES):
        boxes.append(golden.f64s(tracker.update(frame(k)), 9))
        scores.append(golden.f64s(tracker.score, 9))
    return {"networks": list(names), "first": BOX, "boxes": boxes, "scores": scores}


def main() -> None:
    FOLDER.mkdir(exist_ok=True)
    names = [f"{name}.onnx" for name in ("nanotrack_backbone", "nanotrack_head", "vittrack")]
    for name, model in zip(names, (backbone(), head(), vittrack())):
        data = model.SerializeToString()
        assert len(data) <= MAX_BYTES, f"{name} would be {len(data)} bytes"
        (FOLDER / name).write_bytes(data)
        print(f"wrote {name}: {len(data)} bytes")
    c = CHANNELS
    calls = [
        call(names[0], {"input": [1, 3, 255, 255]}, 1.0, 0.0),
        call(names[0], {"input": [1, 3, 127, 127]}, 1.0, 0.0),
        call(names[1], {"input1": [1, c, 8, 8], "input2": [1, c, 16, 16]}, 1 / 64, -2.0),
        call(names[2], {"template": [1, 3, 128, 128], "search": [1, 3, 256, 256]}, 1 / 64, -2.0),
    ]
    header = golden.header(
        ["onnx", "onnxruntime", "numpy"],
        "Outputs of the made-up networks, and boxes of network.py, counted from 0. Inputs of `calls`: "
        "element [0, c, y, x] is ((31c + 7y + 13x) mod 256) * scale + offset. Sample i of n elements is "
        "element floor(i n / 64). Frames of `tracks`: frame k has in column x, row y, channel c the value "
        "((7 i i + 5 j j + 3 i j + 2c) mod 8) * 25 + ((x + 2y) mod 9) * 6 with i = floor((x + 3k) / 11), "
        "j = floor((y + 2k) / 9); the first is frame 0. `boxes` and "
        "`scores` begin at frame 1.",
    )
    tracks = [track(names[0], names[1]), track(names[2])]
    golden.write(
        FOLDER / "network.json",
        {"header": header, "width": WIDTH, "height": HEIGHT, "calls": calls, "tracks": tracks},
    )


if __name__ == "__main__":
    main()
