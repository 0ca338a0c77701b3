"""Runs every model FOLDER/NAME.onnx on FOLDER/NAME.INPUT.npy and writes FOLDER/NAME.OUTPUT.npy, for onnx_test.cc."""
import pathlib
import sys

import numpy
import onnxruntime

TYPES = {"tensor(float)": numpy.float32, "tensor(int64)": numpy.int64}

for path in sorted(pathlib.Path(sys.argv[1]).glob("*.onnx")):
    session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    beside = str(path.with_suffix(""))
    inputs = {i.name: numpy.load(f"{beside}.{i.name}.npy").astype(TYPES[i.type]) for i in session.get_inputs()}
    for output, values in zip(session.get_outputs(), session.run(None, inputs)):
        numpy.save(f"{beside}.{output.name}.npy", values)
