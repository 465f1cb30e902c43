"""Messages of Foxglove's well-known schemas, which Rerun, Foxglove and Lichtblick draw without a plugin."""

from __future__ import annotations

from typing import TYPE_CHECKING, get_args

from foxglove_schemas_protobuf.Color_pb2 import Color
from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.message import DecodeError
from google.protobuf.timestamp_pb2 import Timestamp
from mcap_protobuf.schema import build_file_descriptor_set

from recordings.geometry import block_poses
from twin.cycle import Level

if TYPE_CHECKING:
    from recordings.geometry import Geometry

WORLD, TABLE, BLOCK_MEASURED, BLOCK_PREDICTED = "world", "table", "block_measured", "block_predicted"

LOG_SCHEMA = Log.DESCRIPTOR.full_name

_LEVELS: dict[Level, Log.Level.ValueType] = {"info": Log.INFO, "warning": Log.WARNING, "error": Log.ERROR}

_GREY = Color(r=0.55, g=0.57, b=0.60, a=1.0)
_BLUE = Color(r=0.20, g=0.45, b=0.85, a=1.0)
_ORANGE = Color(r=1.0, g=0.55, b=0.10, a=0.45)


def well_known_schemas() -> dict[str, bytes]:
    """Serialised FileDescriptorSet of each schema used here, by full name."""
    return {
        kind.DESCRIPTOR.full_name: build_file_descriptor_set(kind).SerializeToString()
        for kind in (Log, FrameTransform, SceneUpdate)
    }


def _stamp(time_ns: int) -> Timestamp:
    return Timestamp(seconds=time_ns // 1_000_000_000, nanos=time_ns % 1_000_000_000)


def log_message(time_ns: int, level: Level, name: str, message: str) -> bytes:
    """Encode an event as foxglove.Log; `time_ns` is ns since 1970."""
    return Log(timestamp=_stamp(time_ns), level=_LEVELS[level], name=name, message=message).SerializeToString()


def parse_log(payload: bytes) -> tuple[Level, str, str]:
    """Level, name and message of a foxglove.Log; ValueError where the bytes are none."""
    log = Log()
    try:
        log.ParseFromString(payload)
    except DecodeError as error:
        raise ValueError(str(error)) from None
    for level in get_args(Level):
        if _LEVELS[level] == log.level:
            return level, log.name, log.message
    return "info", log.name, log.message


def table_transform(time_ns: int, position: float) -> bytes:
    """Encode the table's pose in the world; `position` in m."""
    return FrameTransform(
        timestamp=_stamp(time_ns),
        parent_frame_id=WORLD,
        child_frame_id=TABLE,
        translation=Vector3(x=position),
        rotation=Quaternion(w=1.0),
    ).SerializeToString()


def block_transform(time_ns: int, frame: str, rotation: float, geometry: Geometry) -> bytes:
    """Encode a block's pose on the table; `rotation` in rad, positive towards +x."""
    poses = block_poses(rotation, geometry.width)
    x, y, z = poses.translation[0].tolist()
    qx, qy, qz, qw = poses.quaternion[0].tolist()
    return FrameTransform(
        timestamp=_stamp(time_ns),
        parent_frame_id=TABLE,
        child_frame_id=frame,
        translation=Vector3(x=x, y=y, z=z),
        rotation=Quaternion(x=qx, y=qy, z=qz, w=qw),
    ).SerializeToString()


def _box(time_ns: int, frame: str, centre_z: float, size: tuple[float, float, float], color: Color) -> SceneEntity:
    cube = CubePrimitive(
        pose=Pose(position=Vector3(z=centre_z), orientation=Quaternion(w=1.0)),
        size=Vector3(x=size[0], y=size[1], z=size[2]),
        color=color,
    )
    return SceneEntity(timestamp=_stamp(time_ns), frame_id=frame, id=frame, frame_locked=True, cubes=[cube])


def scene_message(time_ns: int, geometry: Geometry) -> bytes:
    """Encode the boxes of the scene: block measured (solid), block predicted (translucent) and a table top.

    The block's depth and the table's outline are not known here: they are drawn, not measured.
    """
    width, height = geometry.width, geometry.height
    table = (5.0 * width, 3.0 * width, 0.2 * width)
    return SceneUpdate(
        entities=[
            _box(time_ns, TABLE, -0.5 * table[2], table, _GREY),
            _box(time_ns, BLOCK_MEASURED, 0.5 * height, (width, width, height), _BLUE),
            _box(time_ns, BLOCK_PREDICTED, 0.5 * height, (width, 1.1 * width, height), _ORANGE),
        ]
    ).SerializeToString()
