"""Reads a .tflite file, float32 or int8, into a Graph of float weights."""

import numpy as np

import schema
from failure import BAD_INPUT, Failure
from graph import Graph, Op

_DTYPES = {0: np.float32, 2: np.int32, 3: np.uint8, 9: np.int8}


def _quantization(tensor):
    q = tensor.Quantization()
    if q is None or q.ScaleLength() == 0:
        return None
    return q.ScaleAsNumpy(), q.ZeroPointAsNumpy(), q.QuantizedDimension()


class _Reader:
    def __init__(self, path):
        self.path = path
        try:
            data = path.read_bytes()
        except OSError as error:
            raise Failure(BAD_INPUT, f"{path}: cannot be read ({error.strerror})") from None
        if data[4:8] != b"TFL3":
            raise Failure(BAD_INPUT, f"{path}: is no .tflite file")
        self.model = schema.table("Model").Model.GetRootAs(data, 0)
        self.subgraph = self.model.Subgraphs(0)

    def constant(self, index):
        """The real values of a constant tensor; None for one that is computed."""
        tensor = self.subgraph.Tensors(index)
        buffer = self.model.Buffers(tensor.Buffer())
        if buffer.DataLength() == 0:
            return None
        dtype = _DTYPES.get(tensor.Type())
        if dtype is None:
            raise Failure(BAD_INPUT, f"{self.path}: constant {index} has element type {tensor.Type()}, which is not known")
        shape = tensor.ShapeAsNumpy() if tensor.ShapeLength() else ()
        values = buffer.DataAsNumpy().tobytes()
        values = np.frombuffer(values, dtype).reshape(shape)
        quantization = _quantization(tensor)
        if quantization is None:
            return values.astype(np.float32) if dtype == np.float32 else values
        scale, zero, dimension = quantization
        along = [1] * values.ndim
        if len(scale) > 1:
            along[dimension] = len(scale)
        return ((values.astype(np.float64) - zero.reshape(along if len(zero) > 1 else [1] * values.ndim))
                * scale.reshape(along if len(scale) > 1 else [1] * values.ndim)).astype(np.float32)

    def name(self, index):
        return "image" if index == self.subgraph.Inputs(0) else f"t{index}"

    def operators(self):
        codes = {number: name for name, number in schema.enumeration("BuiltinOperator").items()}
        for i in range(self.subgraph.OperatorsLength()):
            op = self.subgraph.Operators(i)
            code = self.model.OperatorCodes(op.OpcodeIndex())
            number = max(code.DeprecatedBuiltinCode(), code.BuiltinCode())
            yield i, codes.get(number, str(number)), op

    def options(self, op, kind):
        options = getattr(schema.table(kind), kind)()
        union = op.BuiltinOptions()
        options.Init(union.Bytes, union.Pos)
        return options

    def graph(self):
        activations = {0: "none", 1: "relu", 3: "relu6"}
        ops, ranges = [], {}
        for number, code, op in self.operators():
            inputs = [op.Inputs(k) for k in range(op.InputsLength())]
            output = self.name(op.Outputs(0))
            base = {"output": output, "inputs": (self.name(inputs[0]),)}
            if code in ("CONV_2D", "DEPTHWISE_CONV_2D"):
                depthwise = code == "DEPTHWISE_CONV_2D"
                o = self.options(op, "DepthwiseConv2DOptions" if depthwise else "Conv2DOptions")
                if o.Padding() != 0 or o.StrideH() != o.StrideW() or o.DilationH() != o.DilationW():
                    raise Failure(BAD_INPUT, f"{self.path}: operator {number} is padded or strided in a way not read here")
                ops.append(Op("depthwise" if depthwise else "conv", **base, weight=self.constant(inputs[1]),
                              bias=self.constant(inputs[2]) if len(inputs) > 2 else None, stride=o.StrideH(),
                              dilation=o.DilationH(), activation=activations[o.Activation()]))
            elif code == "ADD":
                base["inputs"] = tuple(self.name(i) for i in inputs)
                ops.append(Op("add", **base, activation=activations[self.options(op, "AddOptions").Activation()]))
            elif code in ("AVERAGE_POOL_2D", "MEAN"):
                in_shape = self.subgraph.Tensors(inputs[0]).ShapeAsNumpy()
                window = 1 if code == "MEAN" else 0
                if code == "AVERAGE_POOL_2D":
                    o = self.options(op, "Pool2DOptions")
                    if (o.FilterHeight(), o.FilterWidth()) != tuple(in_shape[1:3]):
                        window = o.FilterHeight()
                ops.append(Op("average_pool" if code == "AVERAGE_POOL_2D" else "mean", **base, window=window))
            elif code == "RESIZE_BILINEAR":
                o = self.options(op, "ResizeBilinearOptions")
                size = tuple(int(n) for n in self.constant(inputs[1]))
                ops.append(Op("resize", **base, size_like=self._tensor_of_size(ops, size), align_corners=o.AlignCorners(),
                              half_pixel_centers=o.HalfPixelCenters()))
            elif code == "CONCATENATION":
                base["inputs"] = tuple(self.name(i) for i in inputs)
                ops.append(Op("concat", **base))
            elif code in ("QUANTIZE", "DEQUANTIZE", "CAST"):
                ops.append(Op("quantize", **base))
            elif code == "ARG_MAX":
                ops.append(Op("arg_max", **base))
            else:
                raise Failure(BAD_INPUT, f"{self.path}: operator {number} ({code}) is not read here")
        for i in range(self.subgraph.TensorsLength()):
            quantization = _quantization(self.subgraph.Tensors(i))
            if quantization is not None and len(quantization[0]) == 1:
                ranges[self.name(i)] = (float(quantization[0][0]), int(quantization[1][0]))
        return Graph(ops, self.name(self.subgraph.Outputs(0)), ranges)

    def _tensor_of_size(self, ops, size):
        """The first computed tensor of this height and width (the image, when none is)."""
        for op in ops:
            shape = self.subgraph.Tensors(int(op.output[1:])).ShapeAsNumpy()
            if tuple(shape[1:3]) == size:
                return op.output
        return "image"


def read_tflite(path):
    return _Reader(path).graph()


def input_size(path):
    """(height, width) of the image that a file takes."""
    reader = _Reader(path)
    return tuple(int(n) for n in reader.subgraph.Tensors(reader.subgraph.Inputs(0)).ShapeAsNumpy()[1:3])
