"""A world in which tips touch whole at any tilt."""

import pytest
from flat_square import linear_pose_forces

from pipeline.reading import pressed_sensor


@pytest.fixture
def linear_world(monkeypatch):
    """Let every press of the readings be linear."""
    monkeypatch.setattr(pressed_sensor, "pose_forces", linear_pose_forces)
