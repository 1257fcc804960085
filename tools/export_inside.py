"""What runs inside the environment of tools/export_model.py: one function per maker."""

# pylint: disable=import-outside-toplevel,import-error
import functools
import os
from pathlib import Path

from export_networks import OPENMMLAB, ROBOFLOW, ULTRALYTICS
from throwaway_env import ToolError

OPSET = 17
OPENMMLAB_OPSET = 11
UNTRAINED = "untrained"


def export_ultralytics(network, weights, size, is_open, folder):
    """YOLO-seg by Ultralytics' own exporter."""
    from ultralytics import YOLO

    model = YOLO(f"{network.name}.yaml" if weights == UNTRAINED else weights)
    if model.task != "segment":
        raise ToolError(f"{weights}: not a segmentation network")
    del folder  # the file lies beside the weights
    return model.export(
        format="onnx", imgsz=list(size), opset=OPSET, simplify=True, dynamic=is_open
    )


def export_rfdetr(network, weights, size, is_open, folder):
    """RF-DETR-Seg by the package rfdetr."""
    import rfdetr

    del is_open
    kind = getattr(rfdetr, "RFDETRSeg" + network.name.rsplit("-", 1)[-1].capitalize())
    chosen = {"trained": {}, UNTRAINED: {"pretrain_weights": None}}
    model = kind(**chosen.get(weights, {"pretrain_weights": weights}))
    shape = {} if size is None else {"shape": tuple(size)}
    return model.export(output_dir=str(folder), opset_version=OPSET, verbose=False, **shape)


def rtmdet_deployment():
    """MMDeploy's configuration for RTMDet-Ins and ONNX Runtime, whose operations are ONNX's own."""
    return {
        "onnx_config": {
            "type": "onnx",
            "export_params": True,
            "keep_initializers_as_inputs": False,
            "opset_version": OPENMMLAB_OPSET,
            "save_file": "exported.onnx",
            "input_names": ["input"],
            "output_names": ["dets", "labels", "masks"],
            "input_shape": None,  # that of the network's own pipeline
            "optimize": True,
        },
        "codebase_config": {
            "type": "mmdet",
            "task": "ObjectDetection",
            "model_type": "end2end",
            "post_processing": {
                "score_threshold": 0.05,
                "confidence_threshold": 0.005,
                "iou_threshold": 0.5,
                "max_output_boxes_per_class": 200,
                "pre_top_k": 5000,
                "keep_top_k": 100,
                "background_label_id": -1,
                "export_postprocess_mask": True,
            },
        },
        "backend_config": {"type": "onnxruntime"},
    }


def set_input_size(steps, height, width):
    """Makes a pipeline of MMDetection resize and pad to this size."""
    for step in steps:
        if step["type"] == "Resize":
            step["scale"] = (width, height)
        if step["type"] == "Pad":
            step["size"] = (width, height)


def priors_without_gpu():
    """MMDetection lays the grid of cells on a GPU unless told, and MMDeploy does not tell."""
    from mmdet.models.task_modules.prior_generators import MlvlPointGenerator

    MlvlPointGenerator.single_level_grid_priors = functools.partialmethod(
        MlvlPointGenerator.single_level_grid_priors, device="cpu"
    )


def export_rtmdet(network, weights, size, is_open, folder):
    """RTMDet-Ins by MMDeploy."""
    import mmdet
    import numpy as np
    from mmdeploy.apis import torch2onnx
    from mmengine import Config

    del is_open
    priors_without_gpu()
    size_name = network.name.rsplit("-", 1)[-1]
    configs = Path(mmdet.__file__).parent / ".mim" / "configs" / "rtmdet"
    config = Config.fromfile(configs / f"rtmdet-ins_{size_name}_8xb32-300e_coco.py")
    config.model.backbone.pop("init_cfg", None)  # weights of another training, to be downloaded
    for pipeline in (config.test_pipeline, config.test_dataloader.dataset.pipeline):
        set_input_size(pipeline, *size)
    torch2onnx(
        np.full((*size, 3), 114, np.uint8),
        str(folder),
        "rtmdet.onnx",
        Config(rtmdet_deployment()),
        config,
        None if weights == UNTRAINED else str(weights),
        "cpu",
    )
    return folder / "rtmdet.onnx"


EXPORTS = {
    ULTRALYTICS: export_ultralytics,
    OPENMMLAB: export_rtmdet,
    ROBOFLOW: export_rfdetr,
}


def export(network, weights, size, is_open, folder):
    """Exports into `folder`. @return the file."""
    exported = Path(EXPORTS[network.maker](network, weights, size, is_open, folder))
    if not os.path.isfile(exported):
        raise ToolError(f"the exporter of {network.name} wrote no {exported.name}")
    return exported
