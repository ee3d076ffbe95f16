"""Options of the methods as classes: `register(source, target, options=IcpOptions(gate=0.5))`.

A default that is a share of a cloud's RMS radius ignores points more than 20 times as far out as the median point.
"""

from solvers.core.method import NoOptions
from solvers.methods.flow.flow import FlowOptions
from solvers.methods.icp.fast_robust import FastRobustOptions
from solvers.methods.icp.gicp import GicpOptions
from solvers.methods.icp.kiss import KissOptions
from solvers.methods.icp.options import CappedOptions, IcpOptions, TrimmedOptions
from solvers.methods.icp.surface_icp import SurfaceOptions
from solvers.methods.mmd.mmd import MmdOptions
from solvers.methods.ndt.d2d import D2dOptions
from solvers.methods.ndt.ndt import NdtOptions
from solvers.methods.pairs.congruent import CongruentOptions
from solvers.methods.pairs.graduated import GraduatedOptions
from solvers.methods.pairs.ransac import RansacOptions
from solvers.methods.search.branch_and_bound import BranchAndBoundOptions
from solvers.methods.search.correlative import CorrelativeOptions
from solvers.methods.soft.annealed import SoftOptions
from solvers.methods.soft.belief_propagation import BpOptions
from solvers.methods.soft.cpd import CpdOptions
from solvers.methods.soft.filterreg import FilterRegOptions
from solvers.methods.soft.gmmreg import GmmRegOptions
from solvers.methods.soft.hypotheses import HypothesisOptions

__all__ = [
    "BpOptions",
    "BranchAndBoundOptions",
    "CappedOptions",
    "CongruentOptions",
    "CorrelativeOptions",
    "CpdOptions",
    "D2dOptions",
    "FastRobustOptions",
    "FilterRegOptions",
    "FlowOptions",
    "GicpOptions",
    "GmmRegOptions",
    "GraduatedOptions",
    "HypothesisOptions",
    "IcpOptions",
    "KissOptions",
    "MmdOptions",
    "NdtOptions",
    "NoOptions",
    "RansacOptions",
    "SoftOptions",
    "SurfaceOptions",
    "TrimmedOptions",
]
