"""A world in which tips touch whole at any tilt."""

import pytest
from square_stand_ins import linear_pose_forces

from pipeline.reading import assessment, bruising, lift


@pytest.fixture
def linear_world(monkeypatch):
    """Let every press of the readings be linear."""
    for module in (assessment, bruising, lift):
        monkeypatch.setattr(module, "pose_forces", linear_pose_forces)
