"""Multichannel strips of high resolution and wide swath: echoes, and images free of azimuth ambiguities."""

from ._core.hrws import ChannelWeights, Echo, Sampling, channel_weights, reconstruct, sampling

__all__ = ["ChannelWeights", "Echo", "Sampling", "channel_weights", "reconstruct", "sampling"]
