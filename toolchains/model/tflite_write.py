"""Writes a Graph as a standard .tflite file: float32, or int8 when the graph has ranges.

Field numbers come from the program's schema, which keeps those of the public one; what readers elsewhere also look at
(operator versions, both operator code fields, the quantised dimension) is written too."""

import flatbuffers
import numpy as np

import schema
from quantised import quantize_bias, quantize_weight

# The operator versions at which the public format gained int8 (and half pixel centres).
_VERSIONS = {"CONV_2D": 3, "DEPTHWISE_CONV_2D": 3, "ADD": 2, "AVERAGE_POOL_2D": 2, "MEAN": 2, "RESIZE_BILINEAR": 3}
_CODES = {"conv": "CONV_2D", "depthwise": "DEPTHWISE_CONV_2D", "add": "ADD", "average_pool": "AVERAGE_POOL_2D",
          "mean": "MEAN", "resize": "RESIZE_BILINEAR"}
_ACTIVATIONS = {"none": 0, "relu": 1, "relu6": 3}
_SAME = 0


class _Writer:
    def __init__(self, graph, height, width):
        self.graph, self.shapes = graph, graph.shapes(height, width)
        self.b = flatbuffers.Builder(1 << 20)
        self.types = schema.enumeration("TensorType")
        self.buffers, self.tensors, self.index = [self._table("Buffer")], [], {}

    def _table(self, name, **fields):
        """One table; offsets of its vectors, strings and sub-tables must be made before."""
        module = schema.table(name)
        getattr(module, f"{name}Start")(self.b)
        for key, value in fields.items():
            if value is not None:
                getattr(module, f"{name}Add{key}")(self.b, value)
        return getattr(module, f"{name}End")(self.b)

    def _offsets(self, offsets):
        self.b.StartVector(4, len(offsets), 4)
        for offset in reversed(offsets):
            self.b.PrependUOffsetTRelative(offset)
        return self.b.EndVector()

    def _numbers(self, values, dtype):
        return self.b.CreateNumpyVector(np.ascontiguousarray(values, dtype))

    def _bytes(self, data):
        """A vector of bytes whose first one lies at a multiple of 16, so that kernels may read it in place."""
        self.b.StartVector(1, len(data), 16)
        self.b.head = self.b.head - len(data)
        self.b.Bytes[self.b.head:self.b.head + len(data)] = data
        return self.b.EndVector()

    def tensor(self, name, shape, kind, data=None, scale=None, zero=None, dimension=0):
        quantization = None
        if scale is not None:
            scales, zeros = self._numbers(scale, np.float32), self._numbers(zero, np.int64)
            quantization = self._table("QuantizationParameters", Scale=scales, ZeroPoint=zeros, QuantizedDimension=dimension)
        buffer = 0
        if data is not None:
            data = self._bytes(data)
            buffer = len(self.buffers)
            self.buffers.append(self._table("Buffer", Data=data))
        text, dims = self.b.CreateString(name), self._numbers(shape, np.int32)
        self.index[name] = len(self.tensors)
        self.tensors.append(self._table("Tensor", Shape=dims, Type=self.types[kind], Buffer=buffer, Name=text,
                                        Quantization=quantization))
        return self.index[name]

    def activation(self, name):
        shape = (1, *self.shapes[name])
        if not self.graph.ranges:
            return self.tensor(name, shape, "FLOAT32")
        scale, zero = self.graph.ranges[name]
        return self.tensor(name, shape, "INT8", scale=[scale], zero=[zero])

    def filter(self, op):
        if not self.graph.ranges:
            return [self.tensor(f"{op.output}/weight", op.weight.shape, "FLOAT32", op.weight.astype("<f4").tobytes()),
                    self.tensor(f"{op.output}/bias", op.bias.shape, "FLOAT32", op.bias.astype("<f4").tobytes())]
        dimension = 3 if op.kind == "depthwise" else 0
        weight, scales = quantize_weight(op.weight, dimension)
        bias_scales = np.float32(self.graph.ranges[op.inputs[0]][0]) * scales
        bias = quantize_bias(op.bias, bias_scales)
        zeros = np.zeros(len(scales), np.int64)
        return [self.tensor(f"{op.output}/weight", weight.shape, "INT8", weight.tobytes(), scales, zeros, dimension),
                self.tensor(f"{op.output}/bias", bias.shape, "INT32", bias.astype("<i4").tobytes(), bias_scales, zeros)]

    def options(self, op):
        """(type in the union, table)."""
        act = _ACTIVATIONS[op.activation]
        if op.kind in ("conv", "depthwise"):
            name = "Conv2DOptions" if op.kind == "conv" else "DepthwiseConv2DOptions"
            more = {} if op.kind == "conv" else {"DepthMultiplier": 1}
            fields = dict(Padding=_SAME, StrideW=op.stride, StrideH=op.stride, Activation=act, DilationW=op.dilation,
                          DilationH=op.dilation, **more)
        elif op.kind == "add":
            name, fields = "AddOptions", dict(Activation=act)
        elif op.kind == "average_pool":
            height, width = (op.window, op.window) if op.window else self.shapes[op.inputs[0]][:2]
            name, fields = "Pool2DOptions", dict(Padding=_SAME if op.window else 1, StrideW=width, StrideH=height,
                                                 FilterWidth=width, FilterHeight=height, Activation=act)
        elif op.kind == "mean":
            name, fields = "ReducerOptions", dict(KeepDims=True)
        else:
            name, fields = "ResizeBilinearOptions", dict(AlignCorners=op.align_corners, HalfPixelCenters=op.half_pixel_centers)
        return schema.enumeration("BuiltinOptions")[name], self._table(name, **fields)

    def operator(self, op, codes):
        inputs = [self.index[name] for name in op.inputs]
        if op.weight is not None:
            inputs += self.filter(op)
        elif op.kind == "mean":
            inputs.append(self.tensor(f"{op.output}/axes", (2,), "INT32", np.array([1, 2], "<i4").tobytes()))
        elif op.kind == "resize":
            size = np.array(self.shapes[op.output][:2], "<i4").tobytes()
            inputs.append(self.tensor(f"{op.output}/size", (2,), "INT32", size))
        output = self.activation(op.output)
        kind, options = self.options(op)
        inputs, outputs = self._numbers(inputs, np.int32), self._numbers([output], np.int32)
        return self._table("Operator", OpcodeIndex=codes.index(_CODES[op.kind]), Inputs=inputs, Outputs=outputs,
                           BuiltinOptionsType=kind, BuiltinOptions=options)

    def write(self, description):
        codes = sorted({_CODES[op.kind] for op in self.graph.ops})
        image = self.activation(self.graph.input)
        operators = self._offsets([self.operator(op, codes) for op in self.graph.ops])
        inputs, outputs = self._numbers([image], np.int32), self._numbers([self.index[self.graph.scores]], np.int32)
        tensors = self._offsets(self.tensors)
        subgraph = self._table("SubGraph", Tensors=tensors, Inputs=inputs, Outputs=outputs, Operators=operators)
        numbers = schema.enumeration("BuiltinOperator")
        operator_codes = self._offsets([
            self._table("OperatorCode", DeprecatedBuiltinCode=min(numbers[code], 127), BuiltinCode=numbers[code],
                        Version=_VERSIONS[code] if self.graph.ranges else 1) for code in codes])
        subgraphs, buffers = self._offsets([subgraph]), self._offsets(self.buffers)
        text = self.b.CreateString(description)
        self.b.Finish(self._table("Model", Version=3, OperatorCodes=operator_codes, Subgraphs=subgraphs, Description=text,
                                  Buffers=buffers), b"TFL3")
        return bytes(self.b.Output())


def with_biases(graph):
    """Every convolution with a bias: the format lets it be absent, most runtimes want one."""
    from dataclasses import replace

    ops = []
    for op in graph.ops:
        if op.weight is not None and op.bias is None:
            op = replace(op, bias=np.zeros(op.weight.shape[3 if op.kind == "depthwise" else 0], np.float32))
        ops.append(op)
    return replace(graph, ops=ops)


def tflite_bytes(graph, height, width, description="tactus materials"):
    return _Writer(with_biases(graph), height, width).write(description)
