"""The network: an encoder and a decoder of plain convolutions that say where people are."""
import torch
from torch import nn
from torch.nn import functional as F

from prepare import CHANNELS


def block(inputs, outputs, stride=1):
    return nn.Sequential(nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False), nn.BatchNorm2d(outputs),
                         nn.ReLU(inplace=True))


class Again(nn.Module):
    """Adds what another convolution finds: at first nothing."""

    def __init__(self, width):
        super().__init__()
        self.more = nn.Sequential(nn.Conv2d(width, width, 3, 1, 1, bias=False), nn.BatchNorm2d(width))
        nn.init.zeros_(self.more[1].weight)

    def forward(self, x):
        return F.relu(x + self.more(x))


class Around(nn.Module):
    """Adds what the view looks like as a whole, and each quarter of it."""

    def __init__(self, width):
        super().__init__()
        self.mix = nn.Conv2d(3 * width, width, 1)

    def forward(self, x):
        size = x.shape[-2:]
        whole = x.mean(dim=(2, 3), keepdim=True).expand(-1, -1, *size)
        parts = F.avg_pool2d(x, (size[0] // 2, size[1] // 2))
        parts = F.interpolate(parts, size=size, mode="nearest")
        return F.relu(x + self.mix(torch.cat([x, whole, parts], dim=1)))


class Join(nn.Module):
    """A coarse map, made as fine as another and mixed with it."""

    def __init__(self, coarse, fine):
        super().__init__()
        self.narrow = nn.Conv2d(coarse, fine, 1)
        self.mix = block(2 * fine, fine)

    def forward(self, coarse, fine):
        up = F.interpolate(self.narrow(coarse), size=fine.shape[-2:], mode="nearest")
        return self.mix(torch.cat([up, fine], dim=1))


WIDTHS = (16, 32, 64, 128)


class PeopleNet(nn.Module):
    """N x CHANNELS x H x W to logits N x 1 x H x W, H and W multiples of 4. About 1.1 million weights."""

    def __init__(self, widths=WIDTHS):
        super().__init__()
        a, b, c, d = widths
        self.to_half = block(CHANNELS, a, 2)
        self.to_quarter = nn.Sequential(block(a, b, 2), block(b, b), block(b, b), Again(b))
        self.to_eighth = nn.Sequential(block(b, c, 2), block(c, c), Again(c), Again(c))
        self.to_sixteenth = nn.Sequential(block(c, d, 2), block(d, d), block(d, d), Around(d), Again(d), Again(d))
        self.join_eighth = Join(d, c)
        self.join_quarter = Join(c, b)
        self.people = nn.Sequential(block(b, b), nn.Conv2d(b, 16, 1), nn.PixelShuffle(4))
        nn.init.constant_(self.people[1].bias, -1.5)
        # What the finer cells have to add along outlines: at first nothing.
        self.join_half = Join(b, a)
        self.outline = nn.Sequential(nn.Conv2d(a, 4, 1), nn.PixelShuffle(2))
        nn.init.zeros_(self.outline[0].weight)
        nn.init.zeros_(self.outline[0].bias)

    def forward(self, x):
        half = self.to_half(x)
        quarter = self.to_quarter(half)
        eighth = self.to_eighth(quarter)
        deep = self.to_sixteenth(eighth)
        joined = self.join_quarter(self.join_eighth(deep, eighth), quarter)
        return self.people(joined) + self.outline(self.join_half(joined, half))
