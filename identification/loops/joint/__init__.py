"""LuGre valve and linear process together, from OP and PV alone."""

from identification.loops.joint.inference import JointPosterior, joint_inference, refused
from identification.loops.joint.stem import LugreStem

__all__ = ["JointPosterior", "LugreStem", "joint_inference", "refused"]
