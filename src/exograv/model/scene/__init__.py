"""Picture of a person in a machine: bodies, joints and shapes in metres, from the model alone."""

from .describe import describe_scene as describe_scene
from .description import SceneDescription as SceneDescription
