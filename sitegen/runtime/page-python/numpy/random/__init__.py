from . import _bounded_integers, _common  # noqa: F401
from ._generator import Generator, default_rng
from ._pcg64 import PCG64, PCG64DXSM
from .bit_generator import BitGenerator, SeedSequence

__all__ = ["PCG64", "PCG64DXSM", "BitGenerator", "Generator", "SeedSequence", "default_rng"]


class RandomState:
    """Left out of this numpy; the name stays because default_rng asks whether it was given one."""

    def __init__(self, seed=None):
        raise NotImplementedError("this numpy has default_rng, and no legacy generator")
