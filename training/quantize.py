#!/usr/bin/env python3
"""Makes an int8 model of the people network and says how well both find people in rendered frames.

    training/quantize.py --model people.onnx --frames DIR [DIR ...] --validation DIR --out people_int8.xml

Post-training quantisation by NNCF, calibrated on --count of the rendered frames, evenly spread, as they are:
no recorded pixel goes into the network this way either. Writes OpenVINO IR (OUT and the .bin beside it) and
as a .json of the same name the overlap (IoU) of --model in f32 and of OUT on the validation frames, both as
OpenVINO runs them.
"""
import argparse
import json
import sys
from pathlib import Path

import nncf
import numpy as np
import openvino

import frames as frames_module

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tools"))
from quantize_model import is_quantised, to_int8  # noqa: E402


def evenly(folders, count):
    """Up to `count` frames, evenly spread over all folders."""
    ends = np.cumsum([len(folder) for folder in folders])
    count = min(count, int(ends[-1]))
    for k in range(count):
        which = k * int(ends[-1]) // count
        folder = int(np.searchsorted(ends, which, side="right"))
        yield folders[folder][which - int(ends[folder])]


def overlap(network, frames):
    """Overlap (IoU) on these frames of a network that OpenVINO runs on one thread."""
    compiled = openvino.compile_model(network, "CPU", {"INFERENCE_PRECISION_HINT": "f32",
                                                       "INFERENCE_NUM_THREADS": 1})
    return frames_module.overlap(lambda x: np.concatenate([compiled(one[None])[0] for one in x]) > 0, frames)


def logits_scope(network):
    """The last sum, of the logits: with one range for all of them, which is that of frames without people
    too, they would end at 0.8, and the scores of people, which the program goes by, with them. Stays float."""
    return nncf.IgnoredScope(names=[network.outputs[0].get_node().input_value(0).get_node().get_friendly_name()])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--frames", type=Path, nargs="+", required=True)
    parser.add_argument("--validation", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--count", type=int, default=300, help="frames to calibrate on")
    parser.add_argument("--validation-frames", type=int, default=200)
    a = parser.parse_args()
    network = openvino.convert_model(a.model)
    if is_quantised(network):
        parser.error(f"{a.model} is quantised already")
    held_out = frames_module.read_frames(a.validation)[:a.validation_frames]
    frames = [frames_module.read_frames(folder) for folder in a.frames]
    rng = np.random.default_rng(0)
    inputs = [frames_module.sample(frame, rng, plain=True)[0][None] for frame in evenly(frames, a.count)]
    exact = overlap(network, held_out)
    quantised = to_int8(network, inputs, logits_scope(network))
    openvino.save_model(quantised, a.out, compress_to_fp16=False)
    reached = {"f32": round(exact, 4), "int8": round(overlap(openvino.Core().read_model(a.out), held_out), 4),
               "calibration_frames": len(inputs)}
    a.out.with_suffix(".json").write_text(json.dumps(reached) + "\n", encoding="utf-8")
    print(f"{a.out}: {reached}")


if __name__ == "__main__":
    main()
