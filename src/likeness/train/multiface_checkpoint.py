"""Writes a random checkpoint of the yardstick network with its answers beside it, for multiface_import_test.cc.

multiface_checkpoint.py TORCH_BASELINE.py OUT.pth SIZE [res] [bilinear] [non]

OUT.pth.raw: float32 values of z, view, average texture, mesh, then of the network's texture, mesh, mu and log sigma.
"""
import array
import importlib.util
import sys

import torch
from torch import nn
from torch.nn import functional as F

tool, out, size, options = sys.argv[1], sys.argv[2], int(sys.argv[3]), sys.argv[4:]
sys.argv.append("--stock-malloc")
spec = importlib.util.spec_from_file_location("torch_baseline", tool)
baseline = importlib.util.module_from_spec(spec)
spec.loader.exec_module(baseline)


class Same(baseline.WeightNorm):
    """A convolution 3 x 3 that keeps the side."""

    def __init__(self, inputs, outputs):
        super().__init__((outputs, inputs, 3, 3), outputs, 0)

    def forward(self, x):
        return F.conv2d(x, self.effective(), self.bias, 1, 1)


class Repeated(Same):
    def forward(self, x):
        return super().forward(F.interpolate(x, scale_factor=2))


def add_residuals(block, last):
    block.res1 = Same(*2 * [block.conv1.bias.shape[-3] if block.conv1.bias.dim() > 1 else block.conv1.bias.shape[0]])
    block.res2 = Same(*2 * [block.conv2.bias.shape[-3] if block.conv2.bias.dim() > 1 else block.conv2.bias.shape[0]])

    def forward(x):
        h = baseline.act(block.conv1(x))
        h = baseline.act(block.res1(h) + h)
        h = block.conv2(h)
        if last:
            return block.res2(h) + h
        h = baseline.act(h)
        return baseline.act(block.res2(h) + h)

    block.forward = forward


torch.manual_seed(1)
vertices = 40
net = baseline.Multiface(size, 3 * vertices, 32, cameras=5).eval()
ups = list(net.dec.texture_decoder.upsample)
for up in ups:
    for conv in (up.conv1, up.conv2):
        if "bilinear" in options:
            conv.deconv = Repeated(conv.deconv.weight.shape[0], conv.deconv.weight.shape[1])
        if "non" in options:
            conv.bias = nn.Parameter(torch.zeros(1, conv.bias.shape[1], 1, 1))
if "res" in options:
    for down in net.enc.texture_encoder.downsample:
        add_residuals(down, False)
    for up in ups:
        add_residuals(up, up is ups[-1])
for name, parameter in net.named_parameters():
    if name.endswith("bias") or name.endswith(".g"):
        parameter.data += torch.randn_like(parameter) * 0.2

z, view = torch.randn(1, 32), F.normalize(torch.tensor([[0.3, 0.1, 0.9]]))
average, mesh = torch.randn(1, 3, size, size), torch.randn(1, 3 * vertices)
with torch.inference_mode():
    texture, shape = net.dec(z, view)
    mu, log_sigma = net.enc(average, mesh)
torch.save({"module." + key: value for key, value in net.state_dict().items()}, out)
with open(out + ".raw", "wb") as file:
    for tensor in (z, view, average, mesh, texture, shape, mu, log_sigma):
        array.array("f", tensor.flatten().tolist()).tofile(file)
