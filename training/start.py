"""Training that goes on from the weights of an ONNX file."""
import numpy as np
import onnx
import torch
from torch import nn

from export import LAST_BIAS, raised_by


def pairs_of(module):
    """Every convolution with the batch normalisation behind it, in the order of the data."""
    for child in module.children():
        if isinstance(child, nn.Sequential) and len(child) > 1 and isinstance(child[1], nn.BatchNorm2d):
            yield child[0], child[1]
        yield from pairs_of(child)


@torch.no_grad()
def take_over(net, path, x):
    """Takes the weights of a network that export.py wrote as far as `net` has them; what is new in
    `net` stays as it is. The file's batch normalisation is folded into the convolutions: here it
    becomes the one that changes nothing about x. What export.py raised the logits by is taken back."""
    model = onnx.load(path)
    weights = {tensor.name.removesuffix("_h"): torch.from_numpy(onnx.numpy_helper.to_array(tensor).astype(np.float32))
               for tensor in model.graph.initializer}
    weights[LAST_BIAS] = weights[LAST_BIAS] - raised_by(model)
    names = {id(module): name for name, module in net.named_modules()}
    normalised = {id(a): b for a, b in pairs_of(net)}
    for module in list(net.modules()):
        name = names[id(module)]
        if not isinstance(module, nn.Conv2d) or f"{name}.weight" not in weights:
            continue
        module.weight.copy_(weights[f"{name}.weight"])
        if module.bias is not None:
            module.bias.copy_(weights[f"{name}.bias"])

    def measure(convolution, _, out):
        norm, name = normalised[id(convolution)], names[id(convolution)]
        mean, variance = out.mean(dim=(0, 2, 3)), out.var(dim=(0, 2, 3))
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(variance)
        if f"{name}.bias" in weights:
            norm.weight.copy_(torch.sqrt(variance + norm.eps))
            norm.bias.copy_(mean + weights[f"{name}.bias"])

    hooks = [a.register_forward_hook(measure) for a, _ in pairs_of(net)]
    net.eval()
    net(x)
    for hook in hooks:
        hook.remove()
