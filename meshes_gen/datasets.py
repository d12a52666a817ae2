"""Real meshes that can be fetched: four public ones, three of them models of the paper."""

from __future__ import annotations

from cembench.mesh.datasets import Dataset

_DISK_MAPS = (
    "https://raw.githubusercontent.com/garyptchoi/disk-conformal-map/"
    "9961ed1f7ebc75e481b9b32f77a0af662ca81fe7"
)

chinese_lion = Dataset(
    "chinese-lion",
    "Chinese Lion",
    f"{_DISK_MAPS}/chinese_lion.mat",
    sha256="1a54710cfdfecca95546ca61cd4035e5e02e8b142e81b968c838b5c62957840e",
    licence="Apache-2.0",
    size=500_213,
    paper_row="Chinese Lion",
    mesh_hash="285d3e3ec360fb238b8fe73f6429f1c008c4c78b1608d5fc89489002e1e8c1f5",
)
human_brain = Dataset(
    "human-brain",
    "Human Brain",
    f"{_DISK_MAPS}/human_brain.mat",
    sha256="e6f8c9cd972a465b6affff3233795b208a2a224679c2a9d9c65b2a32b50d43cc",
    licence="Apache-2.0",
    paper_row="Human Brain",
)
left_hand = Dataset(
    "left-hand",
    "Left Hand",
    f"{_DISK_MAPS}/hand.mat",
    sha256="a88112a32b7f9d351c5ecfbd17042253ca79b50ab1a2e86b424e317487935386",
    licence="Apache-2.0",
    paper_row="Left Hand",
)
human_face = Dataset(
    "human-face",
    "Human Face",
    f"{_DISK_MAPS}/human_face.mat",
    sha256="705421e733d7368ec2aa80daa1ca8751bc0afd0d71fa21157049bbc160a64571",
    licence="Apache-2.0",
)
